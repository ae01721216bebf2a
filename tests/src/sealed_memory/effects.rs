//! Effects with memory that a plant has and its model lacks, and static laws for the sets without memory.

/// An effect that brings a hidden state into a plant, or a static law, or nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// No effect: the model is complete.
    None,
    /// A static law: a term of the equation that gets effects, by name.
    Static(&'static str),
    /// The sensor follows the output with a time constant.
    SensorLag,
    /// The plant follows the recorded input with a time constant.
    InputLag,
    /// The plant gets the recorded input some samples late.
    InputDelay,
    /// A second capacity exchanges with the first; nothing else flows into it.
    SecondMass,
    /// A second capacity exchanges with the first, and loses to the surroundings.
    LossySecondMass,
    /// A second RC pair in series with the declared one.
    SecondRc,
    /// A second mass on a spring and a damper, driven through the first.
    ElasticMode,
    /// Presliding friction (Dahl 1968).
    Dahl,
    /// Friction of bristles whose strength falls with speed (Canudas de Wit et al. 1995).
    LuGre,
    /// Hysteresis (Bouc 1967; Wen 1976).
    BoucWen,
}

/// Library kinds of effects with a hidden state or a delay.
pub const MEMORY_KINDS: [&str; 11] = [
    "presliding",
    "hysteresis",
    "bristles",
    "hidden-mode",
    "second-inertia",
    "second-capacity",
    "lagged-cross-talk",
    "input-lag",
    "sensor-lag",
    "input-delay",
    "sensor-delay",
];

impl Memory {
    /// Whether the effect is a law of current quantities only, or none.
    pub fn is_without_memory(self) -> bool {
        matches!(self, Self::None | Self::Static(_))
    }

    /// Library kinds that the outputs do not distinguish from the effect, itself first.
    ///
    /// In a linear plant with one input, or none, and one output, only the transfer function matters, with gains
    /// and initial states free. All these effects add a pole. A lag with a share multiplies by
    /// `((1 - share) T s + 1) / (T s + 1)`, a second capacity adds a pole and a zero between those of the plant, and a
    /// lagged path from the input to the output (a second RC pair) adds `c / (T s + 1)`. The zero of the last is
    /// anywhere, also at infinity, where that of a pure lag is; so it stands for all others. A lag of the sensor and one
    /// of the input are equal, and a slow one with a share stands for a second capacity. A pure lag adds no zero, which
    /// no capacity does, except without an input, where zeros do not act, and where the input acts on the output directly
    /// (`has_feedthrough`): the zero of the cell is then between its pole and that of the lag. Delays of input and sensor are equal.
    /// In a nonlinear plant all differ. Dahl's model is that of Bouc and Wen with g = 0 (and half the distance), and that
    /// of bristles with constant strength.
    pub fn equivalents(
        self,
        is_linear: bool,
        has_input: bool,
        has_feedthrough: bool,
    ) -> &'static [&'static str] {
        match (self, is_linear, has_input) {
            (Self::SensorLag | Self::InputLag, true, true) if has_feedthrough => {
                &["sensor-lag", "input-lag", "lagged-cross-talk", "second-capacity"]
            }
            (Self::None | Self::Static(_), ..) => &[],
            (Self::SensorLag, true, true) => &["sensor-lag", "input-lag", "lagged-cross-talk"],
            (Self::SensorLag, true, false) => &["sensor-lag", "second-capacity"],
            (Self::SensorLag, false, _) => &["sensor-lag"],
            (Self::InputLag, true, _) => &["input-lag", "sensor-lag", "lagged-cross-talk"],
            (Self::InputLag, false, _) => &["input-lag"],
            (Self::InputDelay, true, _) => &["input-delay", "sensor-delay"],
            (Self::InputDelay, false, _) => &["input-delay"],
            (Self::SecondMass | Self::LossySecondMass | Self::SecondRc, true, true) => {
                &["second-capacity", "lagged-cross-talk", "sensor-lag", "input-lag"]
            }
            (Self::SecondMass | Self::LossySecondMass, true, false) => &["second-capacity", "sensor-lag"],
            (Self::SecondMass | Self::LossySecondMass, false, _) => &["second-capacity"],
            (Self::SecondRc, ..) => &["lagged-cross-talk"],
            (Self::ElasticMode, ..) => &["second-inertia"],
            (Self::Dahl, ..) => &["presliding", "hysteresis", "bristles"],
            (Self::LuGre, ..) => &["bristles"],
            (Self::BoucWen, ..) => &["hysteresis"],
        }
    }
}
