//! Contract: trap sets (data whose peculiarity is no missing effect) depend on their seed alone. Every kind
//! and plant gives a model file that parses and a table with its columns, and each peculiarity changes the
//! data. Discoveries on these sets run with a command of their own (`discover_battery traps`).
use augsim_equations::model;
use augsim_tests::traps::{
    Class, Defect, GeneratedSet, KINDS, Kind, Logging, Noise, PLANTS, Plant, Trap, draw,
};

/// All pairs of a simulated plant and a peculiarity of its data.
fn pairs() -> impl Iterator<Item = (&'static Plant, &'static Kind)> {
    KINDS.iter().flat_map(|kind| PLANTS.iter().map(move |plant| (plant, kind)))
}

/// Cells of the data table by rows, without the header.
fn rows(drawn: &GeneratedSet) -> impl Iterator<Item = Vec<&str>> {
    drawn.csv.lines().skip(1).map(|line| line.split(',').collect())
}

fn value(cell: &str) -> f64 {
    cell.parse().unwrap_or(f64::NAN)
}

#[test]
fn every_kind_writes_a_readable_set_for_every_plant() {
    for (plant, kind) in pairs() {
        let (name, drawn) = (format!("{}: {}", plant.name, kind.name), draw(plant, kind, 3));
        let declared = model::parse(&drawn.model, "model.toml").unwrap_or_else(|e| panic!("{name}: {e}"));
        let head: Vec<&str> = drawn.csv.lines().next().unwrap_or_default().split(',').collect();
        assert_eq!(head[..3], ["trajectory", "t_s", plant.input], "{name}");
        assert_eq!(declared.outputs.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), head[3..], "{name}");
        let mut last = (String::new(), f64::NAN);
        for row in rows(&drawn) {
            assert_eq!(row.len(), head.len(), "{name}");
            assert!(row[1..3].iter().all(|cell| value(cell).is_finite()), "{name}: {row:?}");
            assert!(row[3..].iter().all(|cell| cell.is_empty() || value(cell).is_finite()), "{name}");
            let time = value(row[1]);
            assert!(row[0] != last.0 || time > last.1, "{name}: {row:?}");
            last = (row[0].to_owned(), time);
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    for (plant, kind) in pairs() {
        let (one, again, other) = (draw(plant, kind, 3), draw(plant, kind, 3), draw(plant, kind, 4));
        assert_eq!((&one.csv, &one.model), (&again.csv, &again.model), "{}: {}", plant.name, kind.name);
        assert_ne!(one.csv, other.csv, "{}: {}", plant.name, kind.name);
    }
}

#[test]
fn every_peculiarity_changes_the_set() {
    for (plant, kind) in pairs().filter(|(_, kind)| kind.name != "white noise") {
        let plain = Kind { trap: Trap::Noise(Noise::White), ..*kind };
        let (plain, drawn) = (draw(plant, &plain, 3), draw(plant, kind, 3));
        let changes = plain.csv != drawn.csv || plain.model != drawn.model;
        assert!(changes, "{}: {}", plant.name, kind.name);
    }
}

#[test]
fn defects_stand_out_of_the_noise() {
    for (plant, kind) in pairs().filter(|(_, kind)| kind.class() == Class::Defect) {
        let plain = Kind { trap: Trap::Noise(Noise::White), ..*kind };
        let (plain, drawn) = (draw(plant, &plain, 3), draw(plant, kind, 3));
        let differs = |(a, b): (Vec<&str>, Vec<&str>)| (value(a[3]) - value(b[3])).abs();
        let far = rows(&plain).zip(rows(&drawn)).map(differs).filter(|d| *d > 4.0 * plant.sd[0]).count();
        assert!(far >= 40, "{}: {} in {far} rows", plant.name, kind.name);
    }
}

#[test]
fn defects_of_one_recording_leave_the_others() {
    for defect in [Defect::ParameterInOne, Defect::SurroundingsInOne, Defect::Bump] {
        let kind = |trap| Kind { name: "", trap, allowed: &[] };
        for plant in &PLANTS {
            let plain = draw(plant, &kind(Trap::Noise(Noise::White)), 3);
            let drawn = draw(plant, &kind(Trap::Defect(defect)), 3);
            let changed =
                rows(&plain).zip(rows(&drawn)).filter(|(a, b)| a != b).map(|(a, _)| a[0].to_owned());
            let mut changed: Vec<String> = changed.collect();
            changed.dedup();
            assert_eq!(changed.len(), 1, "{}: {defect:?}", plant.name);
        }
    }
}

#[test]
fn a_late_input_is_late_in_the_table() {
    let kind = |late| Kind { name: "", trap: Trap::Logging(Logging::InputLate(late)), allowed: &[] };
    for plant in &PLANTS {
        let (right, late) = (draw(plant, &kind(0), 3), draw(plant, &kind(4), 3));
        let inputs = |drawn| -> Vec<String> { rows(drawn).map(|row| row[2].to_owned()).take(200).collect() };
        assert_eq!(inputs(&right)[..196], inputs(&late)[4..], "{}", plant.name);
        let outputs = |drawn| -> Vec<String> { rows(drawn).map(|row| row[3].to_owned()).collect() };
        assert_eq!(outputs(&right), outputs(&late), "{}", plant.name);
    }
}
