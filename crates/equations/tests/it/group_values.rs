//! Contract: a parameter with values by group is read and written with them; a record is simulated with the values
//! of its group, and with the nominal value for a group that the model does not know.

use augsim_equations::{EquationSystem, Model, model};
use augsim_system::{Offsets, Prepare, Record, Simulate, Simulated, Task};

fn text_with(parameter: &str) -> String {
    format!(
        "scenario = \"system\"\n[parameters]\nspeed_m_s = {parameter} # of each unit\n[states]\nx_m = {{ start = \"y_m\" }}\n\
         [rates]\nx_m = \"speed_m_s\"\n[outputs]\ny_m = \"x_m\"\n"
    )
}

fn read(parameter: &str) -> Model {
    model::parse(&text_with(parameter), "fleet.toml").unwrap_or_else(|e| panic!("{e}"))
}

const FLEET: &str =
    "{ nominal = 2.0, min = 0.0, per = \"group\", groups = { \"unit 1\" = 1.5, b = 2.5 }, group_sd = 0.7 }";

#[test]
fn values_by_group_are_read_and_written() {
    let fleet = read(FLEET);
    let by_group = fleet.parameters[0].by_group.clone().expect("values by group");
    assert_eq!(by_group.values, [("unit 1".to_owned(), 1.5), ("b".to_owned(), 2.5)]);
    assert_eq!((by_group.sd, fleet.group_names()), (Some(0.7), vec!["b".to_owned(), "unit 1".to_owned()]));
    assert_eq!(fleet.to_toml().expect("a text"), text_with(FLEET), "nothing changed");
    let mut one = fleet.clone();
    one.parameters[0].by_group = None;
    let written = one.to_toml().expect("a text");
    assert_eq!(written, text_with("{ nominal = 2.0, min = 0.0 }"), "the values are removed");
    one.parameters[0].by_group = Some(by_group);
    let again = model::parse(&one.to_toml().expect("a text"), "fleet.toml").expect("a model");
    assert_eq!(again.parameters[0].by_group, fleet.parameters[0].by_group);
}

#[test]
fn wrong_values_by_group_are_refused() {
    let message = |parameter: &str| match model::parse(&text_with(parameter), "fleet.toml") {
        Ok(_) => panic!("{parameter} was read"),
        Err(error) => error.to_string(),
    };
    let without_per = message("{ nominal = 2.0, groups = { a = 1.0 } }");
    assert!(without_per.contains("fleet.toml:3") && without_per.contains("per = \"group\""), "{without_per}");
    let outside = message("{ nominal = 2.0, max = 3.0, per = \"group\", groups = { a = 4.0 } }");
    assert!(outside.contains("parameters.speed_m_s.groups.a") && outside.contains('4'), "{outside}");
    let word = message("{ nominal = 2.0, per = \"unit\" }");
    assert!(word.contains("\"all\" or \"group\""), "{word}");
    let no_spread = message("{ nominal = 2.0, per = \"group\", group_sd = 0.0 }");
    assert!(no_spread.contains("group_sd"), "{no_spread}");
}

#[test]
fn a_record_has_the_values_of_its_group() {
    let fleet = read(FLEET);
    let system = EquationSystem::declared_only(&fleet).expect("a system");
    let end = |system: &EquationSystem, group: usize| {
        let times = vec![0.0, 1.0, 2.0];
        let mut record =
            Record { id: "1".into(), times, values: vec![vec![0.0; 3]], group, ..Record::default() };
        system.prepare(&mut record, &[]).expect("a record");
        let task = Task {
            parameters: &[2.0],
            record: &record,
            window: 0..3,
            start: &[0.0],
            offsets: Offsets::None,
            seeds: &[],
        };
        let mut out = Simulated::default();
        system.simulate(&task, &mut out).expect("a simulation");
        out.value(2, 0)
    };
    let with_groups = system.clone().with_group_values();
    // The groups are sorted by name: `b`, `unit 1`, and a third that the model does not know.
    let ends = [0, 1, 2].map(|group| end(&with_groups, group));
    ends.iter().zip([5.0, 3.0, 4.0]).for_each(|(found, expected)| assert!((found - expected).abs() < 1e-12));
    assert!((end(&system, 0) - 4.0).abs() < 1e-12, "without group values the task decides");
}
