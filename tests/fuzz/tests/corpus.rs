//! Contract: every file that once broke a reader is now rejected or read within the limits of time and
//! memory; and the harness notices a panic, a hang, exhausted memory and an unprintable message.
//!
//! Readers that misbehave on purpose have these defects, because a harness that finds nothing may itself be
//! broken.

use augsim_fuzz::campaign::Campaign;
use augsim_fuzz::limits::MAX_TIME;
use augsim_fuzz::readers::READERS;
use augsim_fuzz::verdict::Class;
use augsim_fuzz::{corpus, parent};
use std::path::Path;
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_fuzz");

#[test]
fn no_case_of_the_corpus_breaks_a_reader() {
    for case in corpus::cases().unwrap() {
        let folder = tempfile::tempdir().unwrap();
        case.files.write(folder.path()).unwrap();
        let finding = parent::case(Path::new(PROGRAM), &case.reader, folder.path(), MAX_TIME).unwrap();
        assert_eq!(finding, None, "{} {}", case.reader, case.name);
    }
}

#[test]
fn the_harness_notices_every_class_of_defect() {
    let folder = tempfile::tempdir().unwrap();
    for (reader, class) in [
        ("deliberate-panic", Class::Panic),
        ("deliberate-hang", Class::Hang),
        ("deliberate-flood", Class::Abort),
        ("deliberate-escape", Class::Broken),
        ("deliberate-chatter", Class::Broken),
    ] {
        let limit = Duration::from_secs(2);
        let finding = parent::case(Path::new(PROGRAM), reader, folder.path(), limit).unwrap();
        assert_eq!(finding.map(|f| f.class), Some(class), "{reader}");
    }
}

#[test]
fn an_input_is_determined_by_seed_and_number() {
    let (first, repeated, other_seed) =
        (Campaign::new(3, None).unwrap(), Campaign::new(3, None).unwrap(), Campaign::new(4, None).unwrap());
    let readers = READERS.len() as u64;
    let mut differing = 0;
    for index in 0..5 * readers {
        assert_eq!(first.input(index).1, repeated.input(index).1, "input {index}");
        differing += u32::from(first.input(index).1 != other_seed.input(index).1);
    }
    assert!(differing > 4 * readers as u32, "another seed gives other inputs");
}
