//! One push along a path of the caller's: for planners, which choose their pushes one by one.

use super::generate::{LaboratoryError, Recipe, Truth};
use super::map;
use crate::push::{Object, Pose, Push, Recorded, Run, simulate};
use augsim_data::random_stream;

/// How far a friction map reaches beyond the object and the rod's way, m.
const MARGIN_M: f64 = 0.1;

impl Recipe {
    /// Poses of the object at `times` (s, increasing) while the rod is at `rod` (x and y, m) at these times, from `start`, on the
    /// friction map of push `index` of `seed`: another map for each, and those of [`generate`](Recipe::generate) where the object starts at the
    /// same place. The truth has inertia where the rod is anywhere faster than `inertia_above_m_s`. No sensor looks: poses are true.
    ///
    /// # Errors
    /// The object is unknown, times and path do not belong together, or the push cannot be simulated.
    pub fn pushed(
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
        let reach_m = lengths.sum::<f64>() + world.object().outline.radius() + MARGIN_M;
        let sheet = &self.support;
        let mut stream = random_stream(seed, "push-map", index);
        let field =
            map::draw(sheet.friction_scatter, sheet.correlation_m, start.position, reach_m, &mut stream);
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
    //! Contract: a push along a caller's path ends elsewhere on every map, the same on the same one, and refuses what is no path.
    use super::super::{Protocol, SupportSheet};
    use super::*;

    fn straight() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..=50).map(|i| 0.02 * f64::from(i)).collect();
        let x = times.iter().map(|t| 0.35 - 0.045 - 0.005 + 0.04 * t).collect();
        let y = vec![-0.02; times.len()];
        (times, x, y)
    }

    #[test]
    fn pushes_differ_by_their_map_and_repeat_with_it() {
        let object = Object::named("rect1").expect("an object");
        let sheet = SupportSheet::named("pu").expect("a support");
        let recipe = Recipe::new(Protocol::Random, &object, sheet, 1);
        let start = Pose::new(0.35, -0.03, 0.0);
        let (times, x, y) = straight();
        let end = |seed, index| {
            let poses = recipe.pushed(start, &times, [&x, &y], seed, index).expect("a push");
            assert_eq!(poses.len(), times.len());
            poses[poses.len() - 1]
        };
        let (one, same, other, elsewhere) = (end(1, 0), end(1, 0), end(1, 1), end(2, 0));
        assert!(one.position[0] > 0.37 && one.angle.abs() > 0.01, "it was pushed: {one:?}");
        assert_eq!((one.position, one.angle), (same.position, same.angle));
        // The scatter of 22 % over the map moves the end by tenths of a millimetre or of a degree at least.
        for far in [other, elsewhere] {
            let moved = (one.position[0] - far.position[0]).hypot(one.position[1] - far.position[1]);
            assert!(moved + 0.045 * (one.angle - far.angle).abs() > 1e-4, "{one:?} {far:?}");
        }
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let object = Object::named("rect1").expect("an object");
        let sheet = SupportSheet::named("pu").expect("a support");
        let recipe = Recipe::new(Protocol::Random, &object, sheet, 1);
        let start = Pose::new(0.0, 0.0, 0.0);
        for (times, x) in [(vec![0.0, 0.0], vec![0.0; 2]), (vec![0.0, 1.0], vec![0.0]), (vec![], vec![])] {
            let refused = recipe.pushed(start, &times, [&x, &vec![0.0; times.len()]], 1, 0);
            assert!(matches!(refused, Err(LaboratoryError::Path)), "{times:?}");
        }
    }
}
