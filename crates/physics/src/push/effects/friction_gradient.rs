//! Friction of the table that varies linearly over it.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::Setting;

/// Friction of the table `mu = mu0 (1 + g.x)` at position x.
///
/// The centre of friction moves by `<rho rho'> g`.
pub struct FrictionGradient;

static SPEC: EffectSpec = EffectSpec {
    kind: "friction-gradient",
    location: Location::Support,
    parameters: &[
        ParameterSpec { name: "gx_per_m", unit: "1/m", min: -5.0, max: 5.0, typical: 1.0, null: 0.0 },
        ParameterSpec { name: "gy_per_m", unit: "1/m", min: -5.0, max: 5.0, typical: 1.0, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &["wear of the table"],
    excludes: &[],
    formula: "mu = mu0 (1 + g.x): the centre of friction moves by <rho rho'> g",
    source: "Yu et al. 2016, IROS, fig. 7 (friction maps)",
    separated_by: &[(
        Rival::Kind("table-tilt"),
        "repeat at another place and on a surface with another friction: the effect of tilt is proportional to 1/friction",
    )],
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for FrictionGradient {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.friction_gradient_per_m = Some([p[0], p[1]]);
    }
}
