//! The result of a simulation: channels, their derivatives, and events.

use crate::Scalar;

/// An event that a simulation passed.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When, s.
    pub time_s: f64,
    /// Features, in the order of the schema's; NaN for those that an event has not.
    pub features: Vec<f64>,
}

impl Event {
    /// The feature of index `i`; not a number where the event has none of this kind.
    pub fn feature(&self, i: usize) -> f64 {
        self.features.get(i).copied().unwrap_or(f64::NAN)
    }
}

/// Values and derivatives of a window. Reuse one for many windows: nothing is allocated once it is large enough.
#[derive(Clone, Debug, Default)]
pub struct Simulated {
    samples: usize,
    channels: usize,
    lanes: usize,
    width: usize,
    /// `[sample][channel]`
    values: Vec<f64>,
    /// `[sample][channel][width]`, zero beyond the lanes.
    slopes: Vec<f64>,
    features: usize,
    event_times: Vec<f64>,
    /// `[event][feature]`
    event_features: Vec<f64>,
    /// Where one block of lanes is simulated, when there are several.
    block: Option<Box<Simulated>>,
}

/// Lanes are stored in rows of a multiple of this, so that a kernel can be compiled for a few widths.
const ROW: usize = 4;

impl Simulated {
    /// Makes room for a window of `samples` and `channels` with derivatives in `lanes`, all zero, and no events with
    /// `features` each.
    pub fn reset(&mut self, samples: usize, channels: usize, lanes: usize, features: usize) {
        (self.samples, self.channels, self.lanes) = (samples, channels, lanes);
        (self.width, self.features) = (lanes.next_multiple_of(ROW), features);
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

    /// Number of lanes.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Length of a row of derivatives: the lanes and zeros up to a multiple of four.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The value of a channel at a sample, in the channel's unit.
    pub fn value(&self, sample: usize, channel: usize) -> f64 {
        self.values[sample * self.channels + channel]
    }

    /// Its derivatives, [`width`](Self::width) of them, in the channel's unit per unit of the seed.
    pub fn slopes(&self, sample: usize, channel: usize) -> &[f64] {
        let first = (sample * self.channels + channel) * self.width;
        &self.slopes[first..first + self.width]
    }

    /// Writes a channel at a sample. Lanes that were not asked for are dropped.
    pub fn set<S: Scalar>(&mut self, sample: usize, channel: usize, x: S) {
        self.set_row(sample, channel, x.value(), x.derivatives().iter().copied());
    }

    /// Writes the value of a channel at a sample and its derivatives, for a system that knows them without dual numbers.
    pub fn set_row(
        &mut self,
        sample: usize,
        channel: usize,
        value: f64,
        slopes: impl IntoIterator<Item = f64>,
    ) {
        let at = sample * self.channels + channel;
        self.values[at] = value;
        let row = &mut self.slopes[at * self.width..][..self.lanes];
        row.iter_mut().zip(slopes).for_each(|(to, from)| *to = from);
    }

    /// Adds an event with its features, in the order of the schema's.
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

    /// Features of an event, in the order of the schema's; NaN for those that an event has not.
    pub fn event(&self, event: usize) -> &[f64] {
        &self.event_features[event * self.features..][..self.features]
    }

    /// All events, in order.
    pub fn events(&self) -> Vec<Event> {
        let times = self.event_times.iter().enumerate();
        times.map(|(i, &time_s)| Event { time_s, features: self.event(i).to_vec() }).collect()
    }

    /// Takes the buffer for single blocks of lanes out.
    pub(super) fn take_block(&mut self) -> Box<Simulated> {
        self.block.take().unwrap_or_default()
    }

    /// Puts the buffer for single blocks of lanes back.
    pub(super) fn put_block(&mut self, block: Box<Simulated>) {
        self.block = Some(block);
    }

    /// Takes over a block, whose lanes are those from `first` on, of `lanes` in all. The first one brings values and events.
    pub(super) fn merge(&mut self, block: &Simulated, first: usize, lanes: usize) {
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
