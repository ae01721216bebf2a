//! The instruction set that expressions are compiled to.

/// Operation code of an instruction, with the meaning of its operands `a`, `b`, `c`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
#[expect(missing_docs, reason = "each of the others is the operation of its name")]
pub enum Code {
    /// The constant whose bits are `a` (low) and `b` (high).
    Constant,
    /// The value of state number `a`.
    State,
    /// The value of input number `a`.
    Input,
    /// The time derivative of input number `a`.
    InputSlope,
    /// Time in seconds since the trajectory began.
    Time,
    /// The value of parameter number `a`.
    Parameter,
    /// The width of smoothed discontinuity number `a`.
    Width,
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    /// Computes `a * b + c` with one rounding (fused).
    MultiplyAdd,
    /// Computes `a * b - c` with one rounding (fused).
    MultiplySubtract,
    /// Computes `c - a * b` with one rounding (fused).
    SubtractProduct,
    Minimum,
    Maximum,
    Absolute,
    /// Selects `b` if `a > 0`, else `c`.
    Select,
    /// Square root of `a`; 0 for negative `a`.
    Sqrt,
    Cbrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Atan2,
    Hypot,
    Power,
    /// Value of table number `b` at argument `a`.
    Table,
    /// Slope of table number `b` at argument `a`.
    TableSlope,
    /// Element number `c` of a list of arguments: its value is `a`, and the element before it `b`.
    Argument,
    /// Rate number `b` of the external function for the arguments in the list that ends with `a`.
    External,
    /// Derivative of rate number `b` of the external function with respect to argument `c` of the list `a`.
    ExternalDerivative,
}

impl Code {
    /// Number of the operands `a`, `b`, `c` that are results of other operations.
    pub fn operands(self) -> usize {
        match self {
            Code::Constant
            | Code::State
            | Code::Input
            | Code::InputSlope
            | Code::Time
            | Code::Parameter
            | Code::Width => 0,
            Code::MultiplyAdd | Code::MultiplySubtract | Code::SubtractProduct | Code::Select => 3,
            Code::Add
            | Code::Subtract
            | Code::Multiply
            | Code::Divide
            | Code::Minimum
            | Code::Maximum
            | Code::Atan2
            | Code::Hypot
            | Code::Power
            | Code::Argument => 2,
            _ => 1,
        }
    }

    /// Whether the operands of the operation may be swapped.
    pub(crate) fn commutes(self) -> bool {
        matches!(self, Code::Add | Code::Multiply)
    }
}

/// An operation with its operands `a`, `b`, `c`: indices of earlier operations, or as documented for its code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Operation {
    pub(crate) code: Code,
    pub(crate) a: u32,
    pub(crate) b: u32,
    pub(crate) c: u32,
}

impl Operation {
    pub(crate) fn new(code: Code, a: u32, b: u32, c: u32) -> Self {
        Self { code, a, b, c }
    }

    pub(crate) fn constant(value: f64) -> Self {
        let bits = value.to_bits();
        Self::new(Code::Constant, bits as u32, (bits >> 32) as u32, 0)
    }

    /// Value of the operation if it is a constant; `None` otherwise.
    pub(crate) fn as_constant(&self) -> Option<f64> {
        let bits = u64::from(self.a) | u64::from(self.b) << 32;
        (self.code == Code::Constant).then(|| f64::from_bits(bits))
    }

    /// Indices of the operations whose results this one uses.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = u32> {
        [self.a, self.b, self.c].into_iter().take(self.code.operands())
    }
}
