//! The result of a simulation: channel values, their derivatives, and events.

/// An event that occurred in a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Time of the event, s.
    pub time_s: f64,
    /// Values of the features at the event, in the order of the schema; NaN for those not defined at an event.
    pub features: Vec<f64>,
}

impl Event {
    /// Value of the feature with index `i` at the event; NaN if it is not defined there.
    pub fn feature(&self, i: usize) -> f64 {
        self.features.get(i).copied().unwrap_or(f64::NAN)
    }
}

/// Channel values and derivatives of a simulated window, and its events.
///
/// Reuse one object for many windows: its buffers are not reallocated once they are large enough.
#[derive(Clone, Debug, Default)]
pub struct Simulated {
    samples: usize,
    channels: usize,
    lanes: usize,
    width: usize,
    /// Simulated channel values as `[sample][channel]`.
    values: Vec<f64>,
    /// Derivatives of the channel values as `[sample][channel][width]`, zero beyond the derivative lanes.
    slopes: Vec<f64>,
    features: usize,
    event_times: Vec<f64>,
    /// Features of the events as `[event][feature]`.
    event_features: Vec<f64>,
    /// Buffer for one block of derivatives, if the task runs in several blocks.
    block: Option<Box<Simulated>>,
}

/// Number to a multiple of which rows of derivatives are padded; kernels then need only a few widths.
const ROW_MULTIPLE: usize = 4;

impl Simulated {
    /// Empties the result for a new window: resizes the buffers, sets values and derivatives to 0, removes events.
    ///
    /// Events added later have `features` features each.
    pub fn reset(&mut self, samples: usize, channels: usize, lanes: usize, features: usize) {
        (self.samples, self.channels, self.lanes) = (samples, channels, lanes);
        (self.width, self.features) = (lanes.next_multiple_of(ROW_MULTIPLE), features);
        self.values.clear();
        self.values.resize(samples * channels, 0.0);
        self.slopes.clear();
        self.slopes.resize(samples * channels * self.width, 0.0);
        self.event_times.clear();
        self.event_features.clear();
    }

    /// Number of samples of the window.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Number of channels of the system.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Number of derivatives of each value (lanes).
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Length of a row of derivatives: their number, padded with zeros to a multiple of four.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Simulated value of a channel at a sample, in the channel's unit.
    pub fn value(&self, sample: usize, channel: usize) -> f64 {
        self.values[sample * self.channels + channel]
    }

    /// Derivatives of a channel at a sample with respect to the seeds, in the channel's unit per unit of the seed.
    ///
    /// The slice has [`width`](Self::width) elements, padded with zeros.
    pub fn slopes(&self, sample: usize, channel: usize) -> &[f64] {
        let first = (sample * self.channels + channel) * self.width;
        &self.slopes[first..first + self.width]
    }

    /// Stores the value and derivatives of a channel at a sample; drops surplus derivatives.
    pub fn set_row(
        &mut self,
        sample: usize,
        channel: usize,
        value: f64,
        slopes: impl IntoIterator<Item = f64>,
    ) {
        let index = sample * self.channels + channel;
        self.values[index] = value;
        let row = &mut self.slopes[index * self.width..][..self.lanes];
        row.iter_mut().zip(slopes).for_each(|(to, from)| *to = from);
    }

    /// Appends an event with its features in the order of the schema; missing ones are NaN.
    pub fn push_event(&mut self, time_s: f64, features: impl IntoIterator<Item = f64>) {
        self.event_times.push(time_s);
        let end = self.event_times.len() * self.features;
        self.event_features.extend(features);
        self.event_features.resize(end, f64::NAN);
    }

    /// Times of all events in the window, s.
    pub fn event_times(&self) -> &[f64] {
        &self.event_times
    }

    /// Features of the event with index `event`, in the order of the schema; NaN for those that are not defined.
    pub fn event(&self, event: usize) -> &[f64] {
        &self.event_features[event * self.features..][..self.features]
    }

    /// All events of the window, in order of time.
    pub fn events(&self) -> Vec<Event> {
        let times = self.event_times.iter().enumerate();
        times.map(|(i, &time_s)| Event { time_s, features: self.event(i).to_vec() }).collect()
    }

    /// Takes out the buffer for one block of derivatives.
    pub(crate) fn take_block(&mut self) -> Box<Simulated> {
        self.block.take().unwrap_or_default()
    }

    /// Puts back the buffer for one block of derivatives.
    pub(crate) fn put_block(&mut self, block: Box<Simulated>) {
        self.block = Some(block);
    }

    /// Copies the derivatives of a block into the lanes from `first` on, of `lanes` in total.
    ///
    /// The block with `first` 0 also sets sizes, values and events.
    pub(crate) fn merge(&mut self, block: &Simulated, first: usize, lanes: usize) {
        if first == 0 {
            self.reset(block.samples, block.channels, lanes, block.features);
            self.values.copy_from_slice(&block.values);
            self.event_times.extend(&block.event_times);
            self.event_features.extend(&block.event_features);
        }
        if block.width == 0 {
            return;
        }
        for (to, from) in self.slopes.chunks_exact_mut(self.width).zip(block.slopes.chunks_exact(block.width))
        {
            to[first..first + block.lanes].copy_from_slice(&from[..block.lanes]);
        }
    }
}
