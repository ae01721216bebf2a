//! Simulation of one push along a path given by the caller, for planners that choose pushes one by one.

use super::generate::{LaboratoryError, PushRecipe, Truth};
use super::map;
use crate::push::{Object, Pose, Push, Recorded, Run, simulate};
use augsim_data::random_stream;

/// Margin of the friction map beyond the object and the path of the rod, m.
const MARGIN_M: f64 = 0.1;

impl PushRecipe {
    /// Simulates one push along the rod path `rod` (x and y, m, at `times`, s); returns the true poses there.
    ///
    /// The object begins at `start`. The friction map is that of push `index` of `seed`: each index has its
    /// own, and it is the one of [`generate`](PushRecipe::generate) if the object starts at the same place.
    /// The object has inertia if the rod is anywhere faster than `inertia_above_m_s`. No measurement noise is
    /// added.
    ///
    /// # Errors
    /// The object is unknown, the path is malformed, or the push cannot be simulated.
    pub fn simulate_along(
        &self,
        start: Pose<f64>,
        times: &[f64],
        rod: [&[f64]; 2],
        seed: u64,
        index: u64,
    ) -> Result<Vec<Pose<f64>>, LaboratoryError> {
        let object = Object::named(&self.object)
            .ok_or_else(|| LaboratoryError::Object { name: self.object.clone() })?;
        let [x, y] = rod;
        let path = Recorded::new(times, x, y).ok_or(LaboratoryError::Path)?;
        let lengths = x.windows(2).zip(y.windows(2)).map(|(x, y)| (x[1] - x[0]).hypot(y[1] - y[0]));
        let fastest =
            lengths.clone().zip(times.windows(2)).map(|(m, t)| m / (t[1] - t[0])).fold(0.0, f64::max);
        let truth = Truth::new(self, &object);
        let world = truth.world(fastest > self.inertia_above_m_s);
        let half_width_m = lengths.sum::<f64>() + world.object().outline.radius() + MARGIN_M;
        let support = &self.support;
        let mut stream = random_stream(seed, "push-map", index);
        let field = map::draw(
            support.friction_scatter,
            support.correlation_m,
            start.position,
            half_width_m,
            &mut stream,
        );
        let push = Push {
            world,
            parameters: truth.parameters(),
            start,
            path: &path,
            field: field.as_ref(),
            steps: Truth::STEPS,
        };
        let mut run = Run::default();
        simulate(&push, times, &mut run)
            .map_err(|source| LaboratoryError::Push { index: index as usize, source })?;
        Ok(run.poses)
    }
}

#[cfg(test)]
mod tests {
    //! Contract: pushes along one path differ with the friction map; the same map gives the same push.
    //!
    //! Malformed paths are errors.
    use super::super::{PushDesign, SupportSheet};
    use super::*;

    fn straight() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..=50).map(|i| 0.02 * f64::from(i)).collect();
        let x = times.iter().map(|t| 0.35 - 0.045 - 0.005 + 0.04 * t).collect();
        let y = vec![-0.02; times.len()];
        (times, x, y)
    }

    #[test]
    fn pushes_differ_between_friction_maps_and_repeat_on_the_same_map() {
        let object = Object::named("rect1").expect("an object");
        let support = SupportSheet::named("pu").expect("a support");
        let recipe = PushRecipe::new(PushDesign::Random, &object, support, 1);
        let start = Pose::new(0.35, -0.03, 0.0);
        let (times, x, y) = straight();
        let end = |seed, index| {
            let poses = recipe.simulate_along(start, &times, [&x, &y], seed, index).expect("a push");
            assert_eq!(poses.len(), times.len());
            poses[poses.len() - 1]
        };
        let (first, same, other, other_seed) = (end(1, 0), end(1, 0), end(1, 1), end(2, 0));
        assert!(first.position[0] > 0.37 && first.angle.abs() > 0.01, "the object moved: {first:?}");
        assert_eq!((first.position, first.angle), (same.position, same.angle));
        // A friction scatter of 22 % moves the end by some tenths of a millimetre or of a degree at least.
        for differing in [other, other_seed] {
            let moved =
                (first.position[0] - differing.position[0]).hypot(first.position[1] - differing.position[1]);
            assert!(moved + 0.045 * (first.angle - differing.angle).abs() > 1e-4, "{first:?} {differing:?}");
        }
    }

    #[test]
    fn malformed_paths_are_errors() {
        let object = Object::named("rect1").expect("an object");
        let support = SupportSheet::named("pu").expect("a support");
        let recipe = PushRecipe::new(PushDesign::Random, &object, support, 1);
        let start = Pose::new(0.0, 0.0, 0.0);
        for (times, x) in [(vec![0.0, 0.0], vec![0.0; 2]), (vec![0.0, 1.0], vec![0.0]), (vec![], vec![])] {
            let result = recipe.simulate_along(start, &times, [&x, &vec![0.0; times.len()]], 1, 0);
            assert!(matches!(result, Err(LaboratoryError::Path)), "{times:?}");
        }
    }
}
