//! Wall and CPU time, and resident memory.

use std::time::Instant;

/// CPU seconds of all threads of this process; absent where the system does not tell (not Linux).
pub fn cpu_seconds() -> Option<f64> {
    let mut total = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        total += text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9;
    }
    Some(total)
}

/// Peak resident memory in MB; absent where the system does not tell (not Linux).
pub fn peak_resident_mb() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Wall and CPU seconds of `f`.
pub fn time(f: impl FnOnce()) -> (f64, Option<f64>) {
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    f();
    let wall = wall.elapsed().as_secs_f64();
    (wall, cpu.and_then(|before| Some(cpu_seconds()? - before)))
}

/// Least seconds of a call of `f`, over about `seconds` of them: wall time of a short call, which some time
/// nobody interrupts; CPU time of long ones, ten at a time.
pub fn least(seconds: f64, mut f: impl FnMut()) -> f64 {
    f();
    let start = Instant::now();
    f();
    let calls = if start.elapsed().as_secs_f64() < 5e-3 { 1 } else { 10 };
    let start = Instant::now();
    let (mut least, mut windows) = (f64::MAX, 0);
    while windows < 3 || start.elapsed().as_secs_f64() < seconds {
        let (wall, cpu) = if calls == 1 {
            let call = Instant::now();
            f();
            (call.elapsed().as_secs_f64(), None)
        } else {
            time(|| (0..calls).for_each(|_| f()))
        };
        least = least.min(cpu.unwrap_or(wall) / f64::from(calls));
        windows += 1;
    }
    least
}
