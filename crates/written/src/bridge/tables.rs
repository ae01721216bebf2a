//! Laws of one feature that data can speak about, over the values that the feature takes in them.

use crate::library::{Motion, Scales};
use crate::model::Model;
use augsim_physics::system::{Schema, Table};

/// Knots of a law of one feature.
const KNOTS: usize = 8;
/// Shares of the values that lie below the first knot, and below the last.
const ENDS: [f64; 2] = [0.01, 0.99];
/// Bound of a knot, in the usual size of an addition to its equation: five thousand times the equation's own rate.
const MOST_OF_A_KNOT: f64 = 1e5;

/// A table of every feature that varies in the data, for every force and flow equation.
pub(super) fn tables(model: &Model, schema: &Schema, scales: &Scales) -> Vec<Table> {
    let targets = Motion::of(model).laws().into_iter();
    let at = |target: usize| {
        let features = schema.features.iter().enumerate();
        features.filter_map(move |(against, feature)| {
            let [first, last] = scales.quantiles(&feature.name, model, ENDS)?;
            let varies = last - first > 1e-6 * (1.0 + first.abs());
            varies.then_some(Table { target, against, first, last, knots: KNOTS })
        })
    };
    targets.flat_map(at).collect()
}

/// The schema with the usual sizes of additions to force and flow equations.
pub(super) fn with_sizes(mut schema: Schema, model: &Model, scales: &Scales) -> Schema {
    for state in Motion::of(model).laws() {
        if let (Some(size), Some(target)) =
            (scales.usual_of_rate(state, model), schema.targets.get_mut(state))
        {
            target.usual = size;
        }
    }
    schema
}

/// Bound of the knots of a table that adds to a target with this usual size, in the unit of the target.
pub(super) fn most_of_a_knot(usual: f64) -> f64 {
    MOST_OF_A_KNOT * usual
}

#[cfg(test)]
mod tests {
    //! Contract: features of a simulation that vary are offered to equations of force and flow, over the values that they take; a
    //! kinematic equation has no law of its own, and without data nothing is offered.
    use super::*;
    use crate::engine::{Options, Record, Window};
    use crate::system::System;

    #[test]
    fn laws_are_offered_over_the_values_that_features_take() {
        let (_, text) =
            crate::example::EXAMPLES.iter().find(|(name, _)| *name == "pendulum").expect("an example");
        let model = crate::model::parse(text, "pendulum.toml").expect("an example");
        let schema = super::super::schema::of(&model);
        assert_eq!(tables(&model, &schema, &Scales::default()), []);
        let compiled = System::compile(&model, &[]).expect("an example");
        let times: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let record = Record::new("swing", times, Vec::new()).expect("times that rise");
        let (start, parameters) = ([0.5, 0.0], model.nominals());
        let window = Window { record: &record, first: 0, last: 399, start: &start, parameters: &parameters };
        let options = Options { method: compiled.declared_method(), substeps: 4 };
        let scales = Scales::of(&compiled, &[window], &options);
        let found = tables(&model, &schema, &scales);
        let named = |table: &Table| {
            (&*schema.targets[table.target].quantity.name, &*schema.features[table.against].name)
        };
        let pairs: Vec<(&str, &str)> = found.iter().map(named).collect();
        let of = ["theta_rad", "omega_rad_s", "abs(omega_rad_s)", "t"];
        assert_eq!(pairs, of.map(|feature| ("omega_rad_s", feature)));
        let [low, high] = [found[0].first, found[0].last];
        assert!(-0.5 < low && low < -0.4 && 0.4 < high && high < 0.5, "{low} {high}");
        let sized = with_sizes(schema, &model, &scales);
        let usual = sized.targets[found[0].target].usual;
        // A twentieth of a rate of at most g / length * sin(0.5 rad), 30.7 rad/s².
        assert!(0.5 < usual && usual < 1.54, "{usual}");
    }
}
