//! Contract: effects may depend on columns that are constant in each trajectory (covariates). Two balls of
//! different size and mass have one drag coefficient. The discovery finds it if mass and radius are columns;
//! without them it can only give each ball its own drag.

use augsim_data::{Dataset, Trajectory, random_stream};
use augsim_discovery::{Discovery, Options, Verdict, discover};
use augsim_physics::model::Model;
use augsim_tests::sealed::{Kind, draw, seal};
use rand_distr::{Distribution, StandardNormal};

const CD: f64 = 0.47;
const GRAVITY: f64 = 9.81;
/// `(radius in m, mass in kg)` of a table-tennis ball and of a baseball.
const BALLS: [(f64, f64); 2] = [(0.02, 0.0027), (0.0365, 0.145)];

/// Drops without bounce, in closed form: z = h - ln cosh(sqrt(g k) t) / k, k = rho Cd A / 2 m.
///
/// If `recorded`, radius and mass are columns of the data.
fn drops(recorded: bool) -> Dataset {
    let mut rng = random_stream(17, "covariates", 0);
    let trajectories = (0..24usize)
        .map(|j| {
            let (radius, mass) = BALLS[j % 2];
            let k = 0.5 * 1.204 * CD * std::f64::consts::PI * radius * radius / mass;
            let height = 4.0 + 0.1 * j as f64;
            let times: Vec<f64> = (0..80).map(|i| f64::from(i) / 100.0).collect();
            let z: Vec<f64> = times
                .iter()
                .map(|t| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    height - ((GRAVITY * k).sqrt() * t).cosh().ln() / k + 1e-3 * noise
                })
                .collect();
            let mut columns = vec![z];
            if recorded {
                columns.extend([vec![mass; times.len()], vec![radius; times.len()]]);
            }
            let group = if j % 2 == 0 { "table tennis" } else { "baseball" };
            Trajectory::new(format!("{j}"), times, columns).expect("well formed").with_group(group)
        })
        .collect::<Result<Vec<_>, _>>()
        .expect("well formed");
    let names: &[&str] = if recorded { &["height_m", "mass_kg", "radius_m"] } else { &["height_m"] };
    Dataset::from_names(names, trajectories).expect("well formed")
}

fn answer(data: &Dataset) -> Discovery {
    let text = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n[release]\nkind = \"free\"\n";
    let model = Model::parse(text, "drops.toml").expect("well formed");
    discover(&model, data, &Options::default(), &mut |_| {}).expect("an answer")
}

#[test]
fn one_coefficient_for_balls_of_known_size_and_mass() {
    let d = answer(&drops(true));
    assert_eq!(d.verdict, Verdict::Explained, "{}", d.sentence);
    assert_eq!(d.effects.len(), 1, "{}", d.sentence);
    let cd = &d.effects[0].parameters["cd"];
    assert!(cd.ci95[0] <= CD && CD <= cd.ci95[1] && (cd.value - CD).abs() < 0.02 * CD, "{cd:?}");
}

#[test]
fn a_drag_for_each_ball_where_size_and_mass_are_not_known() {
    let d = answer(&drops(false));
    let k = &d.effects.iter().find(|e| e.kind == "quadratic-drag").expect(&d.sentence).parameters["k_per_m"];
    assert_eq!(k.groups.len(), 2, "{k:?}");
    assert!(k.groups["table tennis"].value > 10.0 * k.groups["baseball"].value, "{k:?}");
}

#[test]
fn a_drift_counts_from_the_same_moment_on_other_data() {
    let mut rng = random_stream(23, "drift", 0);
    let (mut scene, mut truth) = draw(&mut rng, Some(0), false);
    truth.effects = vec![Kind::Drift(6e-5)];
    (scene.trajectories, scene.rate_hz, scene.noise_m, scene.irregular) = (40, 100.0, 1e-3, false);
    let sealed = seal(&scene, truth, &mut rng).expect("well formed");
    let model = Model::parse(&sealed.model, "sealed.toml").expect("well formed");
    let first = discover(&model, &sealed.data, &Options::default(), &mut |_| {}).expect("an answer");
    assert_eq!(first.effects[0].kind, "restitution-drift", "{}", first.sentence);
    // The last trajectories alone: their mean start is ten minutes after that of all.
    let late = sealed.data.trajectories()[20..].to_vec();
    let late = Dataset::new(sealed.data.columns().to_vec(), late).expect("well formed");
    let augmented = Model::parse(&first.model_toml, "augmented.toml").expect("well formed");
    let second = discover(&augmented, &late, &Options::default(), &mut |_| {}).expect("an answer");
    let [a, b] = [&first, &second].map(|d| d.parameters["restitution"].ci95);
    assert!(a[0] < b[1] && b[0] < a[1], "{a:?} {b:?}");
}
