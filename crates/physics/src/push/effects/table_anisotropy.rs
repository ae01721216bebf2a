//! Anisotropic friction fixed to the table, such as by grain or sanding.

use super::Effect;
use crate::Scalar;
use crate::library::{EffectSpec, Location, Needs, ParameterSpec, Rival};
use crate::push::setting::{Anisotropy, Setting};
use augsim_system::Polar;

/// Friction with dissipation `D = |A^(1/2) v|`, `A = R diag(ratio, 1/ratio) R'`, fixed to the table.
///
/// `R` is the rotation by `angle` in the world frame.
pub struct TableAnisotropy;

static SPEC: EffectSpec = EffectSpec {
    kind: "table-anisotropy",
    location: Location::Support,
    parameters: &[
        ParameterSpec { name: "ratio", unit: "", min: 0.3, max: 3.0, typical: 1.2, null: 1.0 },
        ParameterSpec { name: "angle_rad", unit: "rad", min: -1.6, max: 1.6, typical: 0.0, null: 0.0 },
    ],
    needs: Needs::Nothing,
    equivalent_causes: &["non-associated anisotropy (friction tensor)"],
    excludes: &[],
    formula: "D = |A^(1/2) v|, A = R diag(ratio, 1/ratio) R', R by angle in the world",
    source: "Goyal 1989, thesis, Cornell; Yu et al. 2016, fig. 8",
    first_simulated_at: &[1.02, 0.0],
    amplitude_count: Some(1),
    polar: Some(Polar::Axis),
    separated_by: &[(
        Rival::Kind("object-anisotropy"),
        "push from several start orientations: anisotropy of the table is fixed in the world, anisotropy of the object turns with it",
    )],
    confirmed_by: Some(
        "turn the sheet by 90 degrees: the sign of the deviation changes; measured forces distinguish an elliptic law from a friction tensor",
    ),
    ..EffectSpec::DEFAULT
};

impl<S: Scalar> Effect<S> for TableAnisotropy {
    fn spec(&self) -> &'static EffectSpec {
        &SPEC
    }
    fn apply(&self, p: &[S], setting: &mut Setting<S>) {
        setting.table_anisotropy = Some(Anisotropy { ratio: p[0], angle_rad: p[1] });
    }
}
