//! The result of a simulation: channel values, their derivatives, and events.

/// A simulated event.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Time, s.
    pub time_s: f64,
    /// Features in the order of the schema; NaN for those that are not defined at an event.
    pub features: Vec<f64>,
}

impl Event {
    /// The feature with index `i`; NaN where it is not defined at the event.
    pub fn feature(&self, i: usize) -> f64 {
        self.features.get(i).copied().unwrap_or(f64::NAN)
    }
}

/// Values and derivatives of a simulated window.
///
/// Reuse one buffer for many windows: it is not reallocated once it is large enough.
#[derive(Clone, Debug, Default)]
pub struct Simulated {
    samples: usize,
    channels: usize,
    lanes: usize,
    width: usize,
    /// Values as `[sample][channel]`.
    values: Vec<f64>,
    /// Derivatives as `[sample][channel][width]`, zero beyond the lanes.
    slopes: Vec<f64>,
    features: usize,
    event_times: Vec<f64>,
    /// Event features as `[event][feature]`.
    event_features: Vec<f64>,
    /// Buffer for one block of lanes, if the task runs in several.
    block: Option<Box<Simulated>>,
}

/// Rows of derivatives are padded to a multiple of this; kernels then need only a few widths.
const ROW_MULTIPLE: usize = 4;

impl Simulated {
    /// Resizes the buffers, sets all values and derivatives to 0 and removes all events.
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

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Number of derivative lanes.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Length of a row of derivatives: the lanes, padded with zeros to a multiple of four.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Value of a channel at a sample, in the channel's unit.
    pub fn value(&self, sample: usize, channel: usize) -> f64 {
        self.values[sample * self.channels + channel]
    }

    /// Derivatives of a channel at a sample, in the channel's unit per unit of the seed.
    ///
    /// The slice has [`width`](Self::width) elements.
    pub fn slopes(&self, sample: usize, channel: usize) -> &[f64] {
        let first = (sample * self.channels + channel) * self.width;
        &self.slopes[first..first + self.width]
    }

    /// Stores value and derivatives of a channel at a sample; drops surplus derivatives.
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

    /// Times of the events, s.
    pub fn event_times(&self) -> &[f64] {
        &self.event_times
    }

    /// Features of an event in the order of the schema; NaN for those that are not defined.
    pub fn event(&self, event: usize) -> &[f64] {
        &self.event_features[event * self.features..][..self.features]
    }

    /// All events in order of time.
    pub fn events(&self) -> Vec<Event> {
        let times = self.event_times.iter().enumerate();
        times.map(|(i, &time_s)| Event { time_s, features: self.event(i).to_vec() }).collect()
    }

    /// Takes the buffer for one block of lanes out.
    pub(crate) fn take_block(&mut self) -> Box<Simulated> {
        self.block.take().unwrap_or_default()
    }

    /// Puts the buffer for one block of lanes back.
    pub(crate) fn put_block(&mut self, block: Box<Simulated>) {
        self.block = Some(block);
    }

    /// Copies the derivatives of a block into lanes `first..` of `lanes` in total.
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
