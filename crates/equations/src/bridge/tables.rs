//! Table effects that discovery may try: functions of a single quantity over its range in the data.

use crate::library::{Kinematics, Scales};
use crate::model::Model;
use augsim_system::{Schema, Table};

/// Number of knots of a table effect that discovery tries.
const KNOT_COUNT: usize = 8;
/// Quantiles of a quantity's values in the data at which the first and the last knot of a table lie.
const RANGE_QUANTILES: [f64; 2] = [0.01, 0.99];
/// Bound of the values at the knots, as a multiple of the typical size of a term in their equation.
///
/// The bound is 5000 times the equation's own rate.
const KNOT_BOUND_RATIO: f64 = 1e5;

/// Proposes a table of every quantity that varies in the data, for every force and flow equation.
pub(super) fn tables(model: &Model, schema: &Schema, scales: &Scales) -> Vec<Table> {
    let targets = Kinematics::from_model(model).force_and_flow_states().into_iter();
    let tables_of_target = |target: usize| {
        let features = schema.features.iter().enumerate();
        features.filter_map(move |(against, feature)| {
            let [first, last] = scales.quantiles(&feature.name, model, RANGE_QUANTILES)?;
            let varies = last - first > 1e-6 * (1.0 + first.abs());
            varies.then_some(Table { target, feature: against, first, last, knots: KNOT_COUNT })
        })
    };
    targets.flat_map(tables_of_target).collect()
}

/// Sets the typical sizes of additional terms in force and flow equations in a schema.
pub(super) fn with_typical_sizes(mut schema: Schema, model: &Model, scales: &Scales) -> Schema {
    for state in Kinematics::from_model(model).force_and_flow_states() {
        if let (Some(size), Some(target)) =
            (scales.typical_rate_change(state, model), schema.targets.get_mut(state))
        {
            target.typical = size;
        }
    }
    schema
}

/// Bound of the values at the knots of a table, in the unit of the target, from the target's typical size.
pub(super) fn knot_bound(typical_size: f64) -> f64 {
    KNOT_BOUND_RATIO * typical_size
}

#[cfg(test)]
mod tests {
    //! Contract: quantities that vary in a simulation are proposed for force and flow equations, over the
    //! range they have; nothing is proposed for a kinematic equation, and nothing without data.
    use super::*;
    use crate::engine::{Options, Record, Window};
    use crate::system::System;

    #[test]
    fn tables_cover_the_range_of_their_quantities() {
        let (_, text) =
            crate::example::EXAMPLES.iter().find(|(name, _)| *name == "pendulum").expect("an example");
        let model = crate::model::parse(text, "pendulum.toml").expect("an example");
        let schema = super::super::schema::schema_of(&model);
        assert_eq!(tables(&model, &schema, &Scales::default()), []);
        let compiled = System::compile(&model, &[]).expect("an example");
        let times: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let record = Record::new("swing", times, Vec::new()).expect("times that rise");
        let (start, parameters) = ([0.5, 0.0], model.nominals());
        let window = Window { record: &record, first: 0, last: 399, start: &start, parameters: &parameters };
        let options = Options { method: compiled.declared_method(), substeps: 4 };
        let scales = Scales::sample(&compiled, &[window], &options);
        let found = tables(&model, &schema, &scales);
        let names_of = |table: &Table| {
            (&*schema.targets[table.target].quantity.name, &*schema.features[table.feature].name)
        };
        let pairs: Vec<(&str, &str)> = found.iter().map(names_of).collect();
        let expected = ["theta_rad", "omega_rad_s", "abs(omega_rad_s)", "t"];
        assert_eq!(pairs, expected.map(|feature| ("omega_rad_s", feature)));
        let [low, high] = [found[0].first, found[0].last];
        assert!(-0.5 < low && low < -0.4 && 0.4 < high && high < 0.5, "{low} {high}");
        let sized = with_typical_sizes(schema, &model, &scales);
        let typical_size = sized.targets[found[0].target].typical;
        // A twentieth (TYPICAL_RATIO) of a rate of at most g / length * sin(0.5 rad) = 30.7 rad/s².
        assert!(0.5 < typical_size && typical_size < 1.54, "{typical_size}");
    }
}
