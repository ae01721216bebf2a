//! Contract: a data set that is written and read back is equal to the last bit, plain or gzip, with gaps and
//! groups, for any lengths and sample times; and equal data sets give equal bytes.

use augsim_data::{Dataset, MissingCells, Trajectory, read_csv, read_dataset, write_csv};
use proptest::prelude::*;

/// Generates any finite double or a gap; bits are drawn, so that subnormals, both zeros and extremes occur.
fn cell() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(|bits| {
        let value = f64::from_bits(bits);
        if value.is_finite() { value } else { f64::NAN }
    })
}

/// Trajectory identifier with separators, quotes and spaces inside, which the writer has to quote.
fn id(index: usize, text: &str) -> String {
    format!("{text}{index}")
}

prop_compose! {
    fn trajectory(columns: usize)(
        start in -1e9..1e9_f64,
        steps in prop::collection::vec(1e-3..10.0_f64, 0..6),
        pool in prop::collection::vec(cell(), 6 * columns),
    ) -> (Vec<f64>, Vec<Vec<f64>>) {
        let mut time = vec![start];
        time.extend(steps.iter().scan(start, |t, step| { *t += step; Some(*t) }));
        let values = pool.chunks(6).map(|chunk| chunk[..time.len()].to_vec()).collect();
        (time, values)
    }
}

prop_compose! {
    fn dataset()(
        has_groups: bool,
        text in "[a-z\",; é-]{1,5}",
        rows in prop::collection::vec(trajectory(3), 1..5),
    ) -> Dataset {
        let text = text.trim_start();
        let trajectories = rows.into_iter().enumerate().map(|(i, (time, values))| {
            let t = Trajectory::new(id(i, text), time, values).expect("valid by construction");
            if has_groups { t.with_group(id(i % 2, text)).expect("a label") } else { t }
        });
        Dataset::from_names(&["height_m", "velocity_m_s", "pusher_new"], trajectories.collect())
            .expect("valid by construction")
    }
}

/// Bits of all values and times of a data set, for comparisons, because NaN is not equal to itself.
fn bits(set: &Dataset) -> Vec<Vec<Vec<u64>>> {
    let column = |samples: &Vec<f64>| samples.iter().map(|v| v.to_bits()).collect();
    let rows = |t: &Trajectory| {
        let mut columns: Vec<Vec<u64>> = t.values().iter().map(column).collect();
        columns.push(t.time_s().iter().map(|v| v.to_bits()).collect());
        columns
    };
    set.trajectories().iter().map(rows).collect()
}

fn labels(set: &Dataset) -> Vec<(&str, Option<&str>)> {
    set.trajectories().iter().map(|t| (t.id(), t.group())).collect()
}

proptest! {
    #[test]
    fn a_written_data_set_reads_back_to_the_last_bit(set in dataset()) {
        let folder = tempfile::tempdir().unwrap();
        let (plain, packed) = (folder.path().join("d.csv"), folder.path().join("d.csv.gz"));
        write_csv(&set, &plain).unwrap();
        write_csv(&set, &packed).unwrap();
        prop_assert_eq!(&std::fs::read(&packed).unwrap()[..2], &[0x1f, 0x8b]);
        for path in [&plain, &packed] {
            let back = read_csv(path, MissingCells::AsGap).unwrap();
            prop_assert_eq!(back.columns(), set.columns());
            prop_assert_eq!(labels(&back), labels(&set));
            prop_assert_eq!(bits(&back), bits(&set));
            prop_assert_eq!(back.path(), Some(path.as_path()));
        }
        let again = folder.path().join("again.csv.gz");
        write_csv(&set, &again).unwrap();
        prop_assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(&packed).unwrap());
    }
}

#[test]
fn gzip_is_recognised_from_content_and_spaces_and_column_order_do_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plain.gz");
    let text = "\u{feff}height_m, t_s ,group,trajectory\r\n1.5, 0 ,golf ball,a\r\n\r\n2,1,golf ball,a\r\n";
    std::fs::write(&path, text).unwrap();
    let set = read_csv(&path, MissingCells::Refuse).unwrap();
    let only = &set.trajectories()[0];
    assert_eq!((only.id(), only.group()), ("a", Some("golf ball")));
    assert_eq!(only.time_s(), [0.0, 1.0]);
    assert_eq!(only.column(set.column_index("height_m").unwrap()), [1.5, 2.0]);
}

#[test]
fn covariates_are_the_columns_that_are_constant_within_each_trajectory() {
    let t = |id: &str, mass: f64, x: [f64; 2], gap: [f64; 2]| {
        Trajectory::new(id, vec![0.0, 1.0], vec![vec![mass; 2], x.to_vec(), gap.to_vec()]).unwrap()
    };
    let rows = vec![t("a", 1.0, [3.0, 3.0], [f64::NAN; 2]), t("b", 2.0, [3.0, 4.0], [1.0; 2])];
    let set = Dataset::from_names(&["mass_kg", "x_m", "pusher_flag"], rows).unwrap();
    let names: Vec<&str> = set.covariates().map(|c| c.name()).collect();
    assert_eq!(names, ["mass_kg"], "x_m changes in b; pusher_flag has gaps in a");
    assert_eq!(set.trajectories()[1].constant(0), Some(2.0));
    assert_eq!(set.trajectories()[1].constant(1), None);
}

#[test]
fn the_ball_layout_is_recognised_and_converts_to_the_long_form_without_loss() {
    let path = crate::shared_data::workspace().join("fixtures/pybullet-ball/test_first5.csv.gz");
    let ball = read_dataset(&path, MissingCells::Refuse).unwrap();
    let names: Vec<&str> = ball.columns().iter().map(|c| c.name()).collect();
    assert_eq!(names, ["height_m", "velocity_m_s"]);
    let ids: Vec<&str> = ball.trajectories().iter().map(|t| t.id()).collect();
    assert_eq!(ids, ["0", "1", "2", "3", "4"]);
    let first = &ball.trajectories()[0];
    assert_eq!(first.time_s()[..2], [0.0, 0.0166667]);
    assert_eq!(first.column(0)[..2], [4.79749, 4.79476]);
    assert_eq!(first.column(1)[..2], [0.0, -0.163333]);

    let folder = tempfile::tempdir().unwrap();
    let long = folder.path().join("long.csv");
    write_csv(&ball, &long).unwrap();
    let back = read_dataset(&long, MissingCells::Refuse).unwrap();
    assert_eq!(back.with_path(&path), ball);
}
