//! Measured rigs with several units, repeated runs or hidden states: their files and declared models.

/// A measured rig.
#[derive(Debug, Clone, Copy)]
pub struct Set {
    /// Name of the folder with the data of the set, in `data.csv.gz`.
    pub name: &'static str,
    /// Text of the model file with the textbook model.
    pub model: &'static str,
    /// Name of the column with the group of each recording; `None` if the recordings are not grouped.
    pub groups: Option<&'static str>,
    /// Recordings that are held out of all fits, by the end of their names.
    pub held_out: &'static [&'static str],
    /// Number of first samples of a held-out recording from which its initial state is estimated.
    pub burn_in: usize,
    /// What the declared model is known to lack.
    pub lacks: &'static str,
    /// Citation of the source of the data.
    pub source: &'static str,
}

/// All rigs of `reproduce rigs`.
pub const SETS: [Set; 5] = [
    Set {
        name: "tclab-sao-paulo",
        model: include_str!("../../models/rigs/tclab.toml"),
        groups: None,
        held_out: &["06", "07", "08", "09", "10"],
        burn_in: 5,
        lacks: "radiation, lag of the sensors, a second heat capacity; repeats of one run differ by 0.71 degC at sensor 1",
        source: "github TiagoPrata/TCLabSP: temperature laboratory, ten repeats of a step and of a random sequence",
    },
    Set {
        name: "robot-arm-axis1",
        model: include_str!("../../models/rigs/robot-arm.toml"),
        groups: None,
        held_out: &["validation"],
        burn_in: 20,
        lacks: "elastic gear and arm (two modes), Coulomb and Stribeck friction, a hardening gear spring",
        source: "Wernholt, Gunnarsson: Nonlinear identification of a physically parameterized robot model, SYSID 2006",
    },
    Set {
        name: "nissan-leaf-cell",
        model: include_str!("../../models/rigs/cell.toml"),
        groups: Some("trajectory"),
        held_out: &[],
        burn_in: 5,
        lacks: "a second pair of resistance and capacitor; resistances differ with the temperature of the cell",
        source: "Oak Ridge National Laboratory, doi 10.5281/zenodo.2580327: pulses at 10, 25 and 40 degC",
    },
    Set {
        name: "pneumatic-seal-friction",
        model: include_str!("../../models/next/seal-coulomb.toml"),
        groups: None,
        held_out: &[],
        burn_in: 5,
        lacks: "friction that grows with pressure; friction differs with the shape of the seal (groups), the area does not",
        source: "TU Delft thesis 2021, github EvaZillen/3D-printed-pneumatic-actuator: strokes at set pressures",
    },
    Set {
        name: "hsm150-two-motor",
        model: include_str!("../../models/rigs/motors.toml"),
        groups: None,
        held_out: &["_3"],
        burn_in: 20,
        lacks: "Coulomb friction (0.03 N m holds 140 rad/s), ripple, friction that falls with temperature",
        source: "github malik-robert/HSM150-data: steps of torque, three repeats each",
    },
];

impl Set {
    /// Whether the recording is held out of all fits.
    pub fn is_held_out(&self, recording: &str) -> bool {
        self.held_out.iter().any(|end| recording.ends_with(end))
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the textbook model of each rig is a valid model file.

    use super::*;

    #[test]
    fn models_of_all_rigs_are_valid() {
        for set in SETS {
            augsim_equations::model::parse(set.model, set.name).expect("a model");
        }
    }
}
