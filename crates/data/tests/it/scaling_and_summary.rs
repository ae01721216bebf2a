//! Contract: scales are fitted to the training set alone, can be inverted and survive serialisation; the
//! summary has figures that can be checked by hand.

use augsim_data::{Dataset, Normaliser, Summary, Trajectory};

fn drops() -> Dataset {
    let t = |id: &str, time: &[f64], height: &[f64], mass: f64| {
        let values = vec![height.to_vec(), vec![mass; time.len()]];
        Trajectory::new(id, time.to_vec(), values).and_then(|t| t.with_group("golf")).expect("valid")
    };
    let rows = vec![
        t("a", &[0.0, 0.5, 1.0, 1.5], &[4.0, 3.0, f64::NAN, 1.0], 0.05),
        t("b", &[0.0, 0.5, 2.0], &[5.0, 5.0, 0.0], 0.05),
    ];
    Dataset::from_names(&["height_m", "mass_kg"], rows).expect("valid")
}

#[test]
fn mean_and_sd_ignore_gaps_and_a_constant_column_has_scale_one() {
    // Heights 4, 3, 1, 5, 5, 0: mean 3, squared deviations 1+0+4+4+4+9 = 22.
    let scales = Normaliser::fit(&drops(), &["mass_kg", "height_m"]).unwrap();
    let height = scales.scale("height_m").unwrap();
    assert_eq!((height.mean, height.sd), (3.0, (22.0_f64 / 6.0).sqrt()));
    let mass = scales.scale("mass_kg").unwrap();
    assert_eq!((mass.mean, mass.sd), (0.05, 1.0));

    let mut scaled = scales.apply(&drops(), 1).unwrap();
    assert_eq!(scaled[0], [0.0; 3], "fitted order: mass first");
    scales.invert(&mut scaled);
    for (back, height) in scaled[1].iter().zip([5.0, 5.0, 0.0]) {
        // One division and one multiplication by the same number give two rounding errors of numbers below 6.
        assert!((back - height).abs() <= 6.0 * 2.0 * f64::EPSILON);
    }
    let stored = serde_json::to_string(&scales).unwrap();
    assert_eq!(serde_json::from_str::<Normaliser>(&stored).unwrap(), scales);
}

#[test]
fn a_small_spread_about_a_large_mean_is_accurate() {
    let epoch = 1.45e9;
    let values = vec![vec![epoch - 1.0, epoch, epoch + 1.0]];
    let rows = vec![Trajectory::new("a", vec![0.0, 1.0, 2.0], values).unwrap()];
    let set = Dataset::from_names(&["clock_s"], rows).unwrap();
    let scale = Normaliser::fit(&set, &["clock_s"]).unwrap().scales()[0].clone();
    // Deviations of 1 are exact here; a single pass over the squares (2e18) would lose them.
    assert_eq!(scale.sd, (2.0_f64 / 3.0).sqrt());
}

#[test]
fn columns_that_cannot_be_scaled_are_errors() {
    let text = |set: &Dataset, name| Normaliser::fit(set, &[name]).unwrap_err().to_string();
    assert_eq!(
        text(&drops(), "x_m"),
        "data set in memory: there is no column `x_m`; the columns are: height_m, mass_kg; rename a column or use one \
         of these"
    );
    let gap = vec![Trajectory::new("a", vec![0.0], vec![vec![f64::NAN]]).unwrap()];
    let set = Dataset::from_names(&["x_m"], gap).unwrap();
    assert_eq!(
        text(&set, "x_m"),
        "data set in memory: column `x_m` has no measured values, so it cannot be scaled; leave it out"
    );
}

#[test]
fn the_summary_as_text() {
    let expected = "\
drops.csv
2 trajectories, 7 samples, 3 to 4 each (median 3)
groups: golf (2)
sampled at 2 Hz (irregular), 1 gaps up to 1.5 s, 1.5 to 2 s long

column      unit          min         mean          max           sd  missing
height_m       m            0            3            5       1.9149        1
mass_kg       kg         0.05         0.05         0.05            0        0  constant in each trajectory
";
    let summary = Summary::from_dataset(&drops().with_path("drops.csv"));
    assert_eq!(summary.to_string(), expected);
    let json = serde_json::to_value(&summary).unwrap();
    assert_eq!(json["columns"][0]["statistics"]["mean"], 3.0);
    assert_eq!(json["sampling"]["regular"], false);
    assert_eq!(json["groups"]["golf"], 2);
}

#[test]
fn rounded_times_are_regular_and_an_empty_set_has_a_summary() {
    let time: Vec<f64> = (0..100).map(|i| (f64::from(i) / 60.0 * 1e5_f64).round() / 1e5).collect();
    let rows = vec![Trajectory::new("a", time, vec![vec![f64::NAN; 100]]).unwrap()];
    let set = Dataset::from_names(&["x_m"], rows).unwrap();
    let sampling = Summary::from_dataset(&set).sampling.unwrap();
    assert!(sampling.regular && sampling.gaps == 0);
    assert!((sampling.median_rate_hz - 60.0).abs() < 0.05);
    assert!(Summary::from_dataset(&set).to_string().contains("nothing measured      100"));
    assert!(Summary::from_dataset(&set.select(&[])).to_string().contains("0 trajectories, 0 samples"));
}
