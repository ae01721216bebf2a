//! An ensemble of simulated trajectories from one initial state.

/// Random trajectories (draws) from one initial state; sample t of draw i is at index `t * draws + i`.
///
/// Single precision suffices: its relative error of 1e-7 is far below the sampling error.
#[derive(Debug, Clone)]
pub struct Ensemble {
    draws: usize,
    samples: usize,
    height_m: Vec<f32>,
    velocity_m_s: Vec<f32>,
}

impl Ensemble {
    /// An ensemble of `draws` trajectories without samples.
    pub(crate) fn new(draws: usize) -> Self {
        Ensemble { draws, samples: 0, height_m: Vec::new(), velocity_m_s: Vec::new() }
    }

    /// Sets the number of samples of each draw.
    pub(crate) fn resize(&mut self, samples: usize) {
        self.samples = samples;
        self.height_m.resize(samples * self.draws, 0.0);
        self.velocity_m_s.resize(samples * self.draws, 0.0);
    }

    /// Number of draws of the ensemble.
    pub fn draws(&self) -> usize {
        self.draws
    }

    /// Number of samples of each draw, including the initial state.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Heights, m, and velocities, m/s, of all draws at sample `t`.
    ///
    /// # Panics
    /// If `t` is not below the number of samples.
    pub fn at_mut(&mut self, t: usize) -> (&mut [f32], &mut [f32]) {
        let range = t * self.draws..(t + 1) * self.draws;
        (&mut self.height_m[range.clone()], &mut self.velocity_m_s[range])
    }

    /// Heights of all draws at sample `t`, m.
    pub(crate) fn height_at(&self, t: usize) -> &[f32] {
        &self.height_m[t * self.draws..(t + 1) * self.draws]
    }

    /// Velocities of all draws at sample `t`, m/s.
    pub(crate) fn velocity_at(&self, t: usize) -> &[f32] {
        &self.velocity_m_s[t * self.draws..(t + 1) * self.draws]
    }
}
