//! Contract: no file makes a reader or a writer panic, hang or exhaust memory. Mechanism: 20,000 files that are made of the
//! fixtures by changed, cut and repeated bytes, swapped attributes and extreme numbers, from a fixed seed.

use augsim_robot::description::JointKind;
use augsim_robot::{Changes, JointChange, read, to_mjcf, to_urdf, write_back};

use crate::{FIXTURES, fixture};

/// Generator of random numbers: xorshift64* of Vigna (2016).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn below(&mut self, limit: usize) -> usize {
        usize::try_from(self.next() >> 33).expect("31 bits") % limit.max(1)
    }
}

/// Ranges of the values of all attributes of a text.
fn attribute_values(text: &[u8]) -> Vec<std::ops::Range<usize>> {
    let quotes: Vec<usize> = (0..text.len()).filter(|k| text[*k] == b'"').collect();
    quotes.chunks_exact(2).map(|pair| pair[0] + 1..pair[1]).collect()
}

/// Changes a text at a random place.
fn mutate(text: &mut Vec<u8>, random: &mut Random) {
    const EXTREMES: [&str; 12] =
        ["nan", "inf", "-1", "0", "1e308", "1e-320", "-0", "", "0 0 0", "1 2 3 4 5 6 7", "${x}", "true"];
    let (a, b) = (random.below(text.len()), random.below(text.len()));
    let (start, end) = (a.min(b), a.max(b).min(a.min(b) + 200));
    match random.below(14) {
        0 => text[start] = b" <>/\"'=&;-!?azAZ09.\n\0"[random.below(21)],
        1 => drop(text.drain(start..end)),
        2 => {
            let repeated = text[start..end].to_vec();
            text.splice(start..start, repeated);
        }
        3 => text.truncate(start),
        kind => {
            let values = attribute_values(text);
            let Some(first) = values.get(random.below(values.len())).cloned() else { return };
            let other = values[random.below(values.len())].clone();
            let replacement = match kind {
                4..9 => text[other].to_vec(),
                _ => EXTREMES[random.below(EXTREMES.len())].as_bytes().to_vec(),
            };
            text.splice(first, replacement);
        }
    }
}

#[test]
fn mutated_files_are_read_or_refused_and_never_panic() {
    let originals: Vec<String> = FIXTURES.iter().map(|name| fixture(name)).collect();
    let mut random = Random(0x5EED_0001);
    let (mut accepted, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let mut bytes = originals[random.below(originals.len())].clone().into_bytes();
        for _ in 0..=random.below(2) {
            if !bytes.is_empty() {
                mutate(&mut bytes, &mut random);
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        let Ok(robot) = read(&text, "mutated") else {
            refused += 1;
            continue;
        };
        accepted += 1;
        robot.warnings();
        let _ = (read(&to_mjcf(&robot), "mjcf"), read(&to_urdf(&robot), "urdf"));
        let inertias =
            robot.links.iter().enumerate().filter_map(|(k, link)| link.inertia.map(|inertia| (k, inertia)));
        let change = JointChange { damping: Some(0.1), armature: Some(0.2), ..JointChange::default() };
        let moving = robot.joints.iter().enumerate().filter(|(_, joint)| joint.kind != JointKind::Fixed);
        let joints = moving.map(|(joint, _)| (joint, change)).collect();
        // Settings of a file, such as settotalmass, may refuse new inertias.
        let _ = write_back(&text, &robot, &Changes { inertias: inertias.collect(), joints, notes: vec![] });
    }
    // Mutations that refuse everything, or nothing, would test little.
    assert!(accepted > 2_000 && refused > 2_000, "{accepted} accepted, {refused} refused");
}
