//! Contract: forecasts stay accurate if the ball's height at the end of a time step is within 0.2 mm of the
//! ground, so that the impact occurs at this step or at the next. A filter whose height is more uncertain
//! than that forecasts the motion ten rows after the rebound as accurately as for any other drop.
use augsim_data::random_stream;
use augsim_physics::ball::drop_distribution::DropDistribution;
use augsim_trainer::filter::{
    FilterSettings, InitialStatePrior, RandomRestitution, Sensor, evaluate_filtered, same_prefix_lengths,
};
use augsim_trainer::{Sequence, Sequences};
use rand_distr::{Distribution, StandardNormal};

const ROWS: usize = 400;
const SEEN: usize = 75;

#[test]
fn a_ball_that_touches_the_ground_by_a_hair_is_known_behind_its_rebound() {
    let law = DropDistribution::default();
    let mut rng = random_stream(1, "hair", 0);
    let mut items = Vec::new();
    let lowest =
        |h: &[f64]| h.iter().copied().take_while(|h| *h > -1.0).fold(f64::INFINITY, |a, b| a.min(b.abs()));
    for k in 0..4000 {
        let draw: f64 = StandardNormal.sample(&mut rng);
        let ball = augsim_physics::ball::bullet::BulletBall { restitution: 0.5 + 0.1 * draw, ..law.ball };
        let [heights, velocities] = ball.simulate_underside(4.0 + f64::from(k) / 4000.0, 0.0, ROWS);
        // Only the first fall counts.
        if lowest(&heights[..64]) < 2e-4 {
            let states = heights.into_iter().zip(velocities).flat_map(|(h, v)| [h, v]).collect();
            items.push(Sequence { id: k.to_string(), time: ROWS, states, actions: Vec::new() });
        }
    }
    assert!(items.len() > 5, "{}", items.len());
    let columns = ["height_m", "velocity_m_s"].map(String::from).to_vec();
    let test = Sequences { columns, action_columns: Vec::new(), items };
    let floor = RandomRestitution { ball: law.ball, mean: law.restitution_mean, sd: law.restitution_sd };
    let sensor = Sensor::new(vec![Some(0.01), None]).unwrap();
    // Heights are uniform over a metre.
    let start = InitialStatePrior { mean: vec![4.5, 0.0], sd: vec![0.29, 0.0] };
    for seed in 1..=3 {
        let lengths = same_prefix_lengths(&[SEEN], test.items.len());
        let settings = FilterSettings::new(256, seed);
        let score =
            evaluate_filtered(&floor, &test, (&sensor, &start), &lengths, settings).unwrap().remove(0);
        // The floor of all drops with 10 mm is 0.0097 m behind 70 rows and 0.0065 m behind 80.
        assert!(score.all_rows[0] < 0.03, "seed {seed}: {:?} of {} drops", score.all_rows, test.items.len());
    }
}
