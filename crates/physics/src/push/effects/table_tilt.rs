//! Tilt of the table.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec};
use crate::push::setting::Setting;
use augsim_system::Polar;

/// Load `m g sin(theta)` of a tilted table at the centre of mass, downhill along `direction`.
pub struct TableTilt;

static SPEC: EffectSpec = EffectSpec {
    kind: "table-tilt",
    location: Location::Support,
    parameters: &[
        ParameterSpec { name: "theta_rad", unit: "rad", min: 0.0, max: 0.1, typical: 0.017, null: 0.0 },
        ParameterSpec { name: "direction_rad", unit: "rad", min: -3.2, max: 3.2, typical: 0.0, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &[],
    excludes: &[],
    formula: "load m g sin(theta) at the centre of mass, downhill by direction",
    source: "statics",
    first_simulated_at: &[0.001, 0.0],
    amplitude_count: Some(1),
    polar: Some(Polar::Direction),
    costly: true,
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for TableTilt {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        let slope = p[0].sin() / p[0].cos();
        setting.downhill = Some([slope * p[1].cos(), slope * p[1].sin()]);
    }
}
