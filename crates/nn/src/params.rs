//! Named parameters in one flat buffer, and their seeded initialisation.

use augsim_tensor::{Scalar, Tape, TensorError, Var};
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Index of a parameter in its store [`Params`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParamId(usize);

/// How a parameter is initialised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Init {
    /// Random values, uniform on `[-bound, bound]`.
    Uniform {
        /// Half-width of the interval around 0.
        bound: f64,
    },
    /// One constant value for all elements.
    Constant(f64),
}

/// Name, extents and range in the flat buffer of one parameter.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    name: String,
    dims: Vec<usize>,
    start: usize,
    end: usize,
}

/// Named parameters in one flat buffer; gradients and optimiser moments have the same layout.
#[derive(Debug, Clone, PartialEq)]
pub struct Params<T> {
    rng: Xoshiro256PlusPlus,
    entries: Vec<Entry>,
    values: Vec<T>,
}

impl<T: Scalar> Params<T> {
    /// Creates an empty store; `rng` draws the random initial values, in the order of registration.
    pub fn new(rng: Xoshiro256PlusPlus) -> Self {
        Params { rng, entries: Vec::new(), values: Vec::new() }
    }

    /// Adds a parameter with these extents and initial values; returns its index.
    ///
    /// ```
    /// use augsim_data::random_stream;
    /// use augsim_nn::{Init, Params};
    /// let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    /// let w = params.add("w".into(), &[2, 3], Init::Uniform { bound: 0.1 });
    /// let b = params.add("b".into(), &[2], Init::Constant(0.5));
    /// assert!(params.get(w).iter().all(|w| w.abs() <= 0.1));
    /// assert_eq!((params.dims(w), params.get(b)), (&[2, 3][..], &[0.5, 0.5][..]));
    /// ```
    pub fn add(&mut self, name: String, dims: &[usize], init: Init) -> ParamId {
        let (start, n) = (self.values.len(), dims.iter().product::<usize>());
        match init {
            Init::Constant(v) => self.values.extend(std::iter::repeat_n(T::from_f64(v), n)),
            Init::Uniform { bound } => {
                match Uniform::new_inclusive(-bound, bound) {
                    Ok(u) => self.values.extend((0..n).map(|_| T::from_f64(u.sample(&mut self.rng)))),
                    // The bound is infinite only for a layer without inputs, which has no weights.
                    Err(_) => self.values.extend(std::iter::repeat_n(T::ZERO, n)),
                }
            }
        }
        self.entries.push(Entry { name, dims: dims.to_vec(), start, end: start + n });
        ParamId(self.entries.len() - 1)
    }

    /// Values of all parameters, in the order of registration.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Values of all parameters, for an optimiser to change.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Values of one parameter, row-major.
    pub fn get(&self, id: ParamId) -> &[T] {
        let entry = &self.entries[id.0];
        &self.values[entry.start..entry.end]
    }

    /// Extents (shape) of one parameter.
    pub fn dims(&self, id: ParamId) -> &[usize] {
        &self.entries[id.0].dims
    }

    /// Name, extents and values of every parameter, in the order of registration.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &[usize], &[T])> {
        self.entries.iter().map(|e| (e.name.as_str(), &e.dims[..], &self.values[e.start..e.end]))
    }

    /// Extents and mutable values of the parameter `name`; `None` if there is no such parameter.
    pub fn get_mut(&mut self, name: &str) -> Option<(&[usize], &mut [T])> {
        let entry = self.entries.iter().find(|e| e.name == name)?;
        Some((&entry.dims, &mut self.values[entry.start..entry.end]))
    }

    /// Returns the part of a flat buffer, such as the gradients, that belongs to the parameter `name`.
    ///
    /// ```
    /// use augsim_data::random_stream;
    /// use augsim_nn::{Init, Params};
    /// let mut params = Params::<f64>::new(random_stream(1, "init", 0));
    /// params.add("w".into(), &[2], Init::Constant(0.0));
    /// params.add("b".into(), &[1], Init::Constant(0.0));
    /// assert_eq!(params.range_of("b", &[10, 20, 30]), Some(&[30][..]));
    /// assert_eq!(params.range_of("c", &[10, 20, 30]), None);
    /// ```
    pub fn range_of<'a, U>(&self, name: &str, flat: &'a [U]) -> Option<&'a [U]> {
        let entry = self.entries.iter().find(|e| e.name == name)?;
        flat.get(entry.start..entry.end)
    }

    /// Records every parameter as a variable of `tape`; replaces the contents of `bound`.
    ///
    /// # Errors
    /// [`TensorError`] if a parameter is not a valid tensor.
    pub fn bind(&self, tape: &mut Tape<T>, bound: &mut Bound) -> Result<(), TensorError> {
        bound.vars.clear();
        for e in &self.entries {
            bound.vars.push(tape.variable(&e.dims, &self.values[e.start..e.end])?);
        }
        Ok(())
    }

    /// Records every parameter as a constant of `tape`, for prediction.
    ///
    /// # Errors
    /// [`TensorError`] if a parameter is not a valid tensor.
    pub fn bind_frozen(&self, tape: &mut Tape<T>, bound: &mut Bound) -> Result<(), TensorError> {
        bound.vars.clear();
        for e in &self.entries {
            bound.vars.push(tape.constant(&e.dims, &self.values[e.start..e.end])?);
        }
        Ok(())
    }

    /// Copies the gradients of the bound parameters to the flat buffer `into`.
    pub fn gather_grads(&self, tape: &Tape<T>, bound: &Bound, into: &mut [T]) {
        for (e, v) in self.entries.iter().zip(&bound.vars) {
            into[e.start..e.end].copy_from_slice(tape.grad(*v));
        }
    }
}

/// Tape variables of all parameters of a store.
#[derive(Debug, Clone, Default)]
pub struct Bound {
    vars: Vec<Var>,
}

impl std::ops::Index<ParamId> for Bound {
    type Output = Var;
    fn index(&self, id: ParamId) -> &Var {
        &self.vars[id.0]
    }
}
