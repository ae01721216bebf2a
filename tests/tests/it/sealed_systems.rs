//! Contract: generated sets of systems of equations depend on the seed alone, contain the columns that their
//! model files name, and change if an effect is added. Discoveries on many such sets run with a command of
//! their own (`discover_battery systems-null`, …).
use augsim_tests::sealed_systems::{PLANTS, Plant, draw, grammar_laws, library_laws, unlisted_laws};

#[test]
fn every_plant_is_drawn_from_its_seed_alone() {
    for plant in &PLANTS {
        let (one, again, other) = (draw(plant, &[], 3), draw(plant, &[], 3), draw(plant, &[], 11));
        assert_eq!(one.csv, again.csv, "{}", plant.name);
        assert_ne!(one.csv, other.csv, "{}", plant.name);
        let mut lines = one.csv.lines();
        assert_eq!(lines.next(), Some(&*format!("trajectory,t_s,{}", plant.header)));
        for column in plant.header.split(',') {
            assert!(plant.model.contains(&format!("{column} = {{")), "{}: {column}", plant.name);
        }
        let finite = |line: &str| line.split(',').all(|cell| cell.parse::<f64>().is_ok_and(f64::is_finite));
        assert!(lines.clone().all(finite), "{}", plant.name);
        assert_eq!(lines.count(), plant.size.0 * plant.size.1, "{}", plant.name);
    }
}

#[test]
fn laws_move_their_plants() {
    for plant in &PLANTS {
        let plain = draw(plant, &[], 5).csv;
        let lists =
            [library_laws(plant.is_force), grammar_laws(plant.is_force), unlisted_laws(plant.is_force)];
        for law in lists.into_iter().flatten() {
            let drawn = draw(plant, &[(*law, 0.15)], 5);
            assert!(drawn.amounts[0] > 0.0 && drawn.amounts[0].is_finite(), "{}: {}", plant.name, law.name);
            assert_ne!(drawn.csv, plain, "{}: {}", plant.name, law.name);
        }
    }
}

#[test]
fn one_recording_holds_the_samples_of_all_and_is_shaken() {
    for plant in &PLANTS {
        let long = plant.as_one_long_recording();
        let (shaken, still) =
            (draw(&long, &[], 3).csv, draw(&Plant { process_noise: 0.0, ..long }, &[], 3).csv);
        let rows = || shaken.lines().skip(1);
        assert_eq!(rows().count(), plant.size.0 * plant.size.1, "{}", plant.name);
        assert!(rows().all(|row| row.starts_with("0,")) && !shaken.contains("NaN"), "{}", plant.name);
        assert_ne!(shaken, still, "{}", plant.name);
    }
}
