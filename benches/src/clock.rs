//! Measurement of wall time, CPU time and resident memory.

use std::time::Instant;

/// CPU time of all threads of this process, s; `None` if the system does not report it (only Linux does).
pub fn cpu_seconds() -> Option<f64> {
    let mut total = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        total += text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9;
    }
    Some(total)
}

/// Peak resident memory, MB; `None` if the system does not report it (only Linux does).
pub fn peak_resident_mb() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Wall time and CPU time of one call of `f`, s; CPU time is `None` if the system does not report it.
pub fn time(f: impl FnOnce()) -> (f64, Option<f64>) {
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    f();
    let wall = wall.elapsed().as_secs_f64();
    (wall, cpu.and_then(|before| Some(cpu_seconds()? - before)))
}

/// Shortest time of one call of `f`, s, over measurements of about `seconds` in total.
///
/// A call shorter than 5 ms is timed alone by wall time, since some calls run without interruption. Longer
/// calls are timed in tens by CPU time, which interruptions do not change.
pub fn shortest_time(seconds: f64, mut f: impl FnMut()) -> f64 {
    f();
    let start = Instant::now();
    f();
    let calls = if start.elapsed().as_secs_f64() < 5e-3 { 1 } else { 10 };
    let start = Instant::now();
    let (mut shortest, mut measurements) = (f64::MAX, 0);
    while measurements < 3 || start.elapsed().as_secs_f64() < seconds {
        let (wall, cpu) = if calls == 1 {
            let call = Instant::now();
            f();
            (call.elapsed().as_secs_f64(), None)
        } else {
            time(|| (0..calls).for_each(|_| f()))
        };
        shortest = shortest.min(cpu.unwrap_or(wall) / f64::from(calls));
        measurements += 1;
    }
    shortest
}
