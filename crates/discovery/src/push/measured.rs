//! Measured pushes: each stream at its own fresh samples, cut into windows, with the noise of the pose.

use crate::deal;
use crate::statistics::median;
use crate::tally::Tally;
use crate::{DiscoveryError, Options};
use augsim_data::Dataset;
use augsim_physics::model::PushModel;
use augsim_physics::push::{Recorded, enough};
use std::sync::Arc;

/// Travel of the rod in one window of a fit, m: the deviations of one effect grow with it, those of knocks stay apart.
const WINDOW_TRAVEL_M: f64 = 0.05;
/// Fewest third differences from which noise is estimated.
const FEWEST_DIFFERENCES: usize = 20;
/// Rod to outline, m, within which a push counts as one with contact: markers, clocks and outlines are off by a few mm.
const CONTACT_M: f64 = 5e-3;

/// How closely the path that is simulated follows the recorded one, in units of the noise of a pose, and at least, m: the
/// rounding of a log is no motion, and fits integrate no finer.
const PATH: f64 = 0.1;
const PATH_M: f64 = 1e-5;

/// Longest window of a horizon, in units of it: poses are a sample apart, unless some are missing.
const LONGEST: f64 = 1.2;

/// One recorded push.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    /// Name in the data.
    pub id: String,
    /// Times of the rod, s, and its centre, m.
    pub rod_time: Vec<f64>,
    pub rod_x: Vec<f64>,
    pub rod_y: Vec<f64>,
    /// Those of them that are enough to follow the rod's path: times, x, y.
    pub corners: [Vec<f64>; 3],
    /// Times of the fresh poses, s.
    pub time: Vec<f64>,
    /// Fresh poses: m, m, rad without jumps.
    pub pose: Vec<[f64; 3]>,
    /// Number of its group.
    pub group: usize,
}

impl Record {
    /// The rod's path: at rest outside the recorded time.
    pub fn path(&self) -> Option<Recorded<'_>> {
        let [time, x, y] = &self.corners;
        Recorded::new(time, x, y)
    }

    /// Travel of the rod between two times, m.
    fn travel(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let mut at = vec![0.0];
        for k in 1..self.rod_time.len() {
            sum += (self.rod_x[k] - self.rod_x[k - 1]).hypot(self.rod_y[k] - self.rod_y[k - 1]);
            at.push(sum);
        }
        self.time
            .iter()
            .map(|&t| at[self.rod_time.partition_point(|&r| r <= t).clamp(1, at.len()) - 1])
            .collect()
    }

    /// The name of a window: that of the push, with the time at which a piece of a long one begins.
    pub fn name(&self, w: &Window) -> String {
        if w.first == 0 && w.last + 1 == self.time.len() {
            return self.id.clone();
        }
        format!("{} from {:.3} s", self.id, self.time[w.first])
    }

    /// The whole travel, m.
    pub fn length(&self) -> f64 {
        self.travel().last().copied().unwrap_or(0.0)
    }

    /// Cut by `mark`, a value for each pose that does not fall, into pieces of `size` of it.
    fn cut(&self, record: usize, mark: &[f64], size: f64) -> Vec<Window> {
        let n = self.time.len();
        let mut windows: Vec<Window> = Vec::new();
        let mut first = 0;
        for k in 0..n {
            if k + 1 == n || mark[k] - mark[first] >= size {
                windows.push(Window { record, first, last: k });
                first = k + 1;
            }
        }
        // A rest that is too short to say anything goes with its neighbour.
        if let [.., before, last] = &mut windows[..]
            && (mark[last.last] - mark[last.first] < 0.5 * size || last.last - last.first < 3)
        {
            before.last = last.last;
            windows.pop();
        }
        windows.retain(|w| w.last > w.first);
        windows
    }

    /// Windows for fits, by travel of the rod.
    pub fn windows(&self, record: usize) -> Vec<Window> {
        self.cut(record, &self.travel(), WINDOW_TRAVEL_M)
    }

    /// Windows for forecasts over `horizon_s`; whole pieces only, none over a gap that makes it much longer.
    pub fn horizons(&self, record: usize, horizon_s: f64) -> Vec<Window> {
        let mut windows = Vec::new();
        let mut first = 0;
        for k in 1..self.time.len() {
            let length = self.time[k] - self.time[first];
            if length >= horizon_s {
                if length < LONGEST * horizon_s {
                    windows.push(Window { record, first, last: k });
                }
                first = k;
            }
        }
        windows
    }
}

/// Fresh poses `first` to `last` of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    pub record: usize,
    pub first: usize,
    pub last: usize,
}

/// Noise of the pose: x, y in m, angle in rad.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    /// What fits use.
    pub sd: [f64; 3],
    /// White noise between neighbouring samples, where there were enough.
    pub white: Option<[f64; 3]>,
    /// Findings by kind.
    pub findings: Vec<String>,
}

impl Noise {
    /// Share of the variance that is white: the least that residuals can have.
    pub fn white_share(&self) -> f64 {
        self.white.map_or(1.0, |w| (0..3).map(|c| (w[c] / self.sd[c]).powi(2)).sum::<f64>() / 3.0).min(1.0)
    }
}

/// Pushes, their noise, and who is held out.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    /// Where the data come from, for messages.
    pub name: String,
    pub records: Vec<Record>,
    /// Names of the groups, one at least.
    pub groups: Vec<String>,
    pub noise: Noise,
    pub train: Vec<usize>,
    pub test: Vec<usize>,
    /// Work done on these pushes and their copies.
    pub tally: Arc<Tally>,
}

impl Measured {
    /// The number of each push's group.
    pub fn group_of(&self) -> Vec<usize> {
        self.records.iter().map(|r| r.group).collect()
    }
}

pub(crate) fn measure(
    model: &PushModel,
    data: &Dataset,
    options: &Options,
) -> Result<Measured, DiscoveryError> {
    let mut measured = measure_for(model, data, 2)?;
    let everything: Vec<usize> = (0..measured.records.len()).collect();
    (measured.train, measured.test) = split(&measured, &everything, options);
    Ok(measured)
}

/// Pushes with their noise, none of them held out; `fewest` are needed.
pub(crate) fn measure_for(
    model: &PushModel,
    data: &Dataset,
    fewest: usize,
) -> Result<Measured, DiscoveryError> {
    let name = data.path().map_or_else(|| data.origin().to_string(), |p| p.display().to_string());
    let groups = group_names(data);
    if let Some(unknown) = model.unknown_group(&groups.iter().map(String::as_str).collect::<Vec<_>>()) {
        return Err(DiscoveryError::unknown_group(&model.file, &name, unknown, &groups));
    }
    let mut records = records(data, &groups, &name)?;
    let found = records.len();
    if found < fewest {
        return Err(DiscoveryError::TooFew { data: name, found });
    }
    check_contact(model, &records, &name)?;
    let noise = noise(model, &records, &name)?;
    for r in &mut records {
        let kept = enough(&r.rod_time, &r.rod_x, &r.rod_y, (PATH * noise.sd[0]).max(PATH_M));
        r.corners = [&r.rod_time, &r.rod_x, &r.rod_y].map(|z| kept.iter().map(|&k| z[k]).collect());
    }
    let tally = Arc::default();
    Ok(Measured { name, records, groups, noise, train: Vec::new(), test: Vec::new(), tally })
}

/// Pushes for training and pushes held out, of those at `chosen` (two or more).
pub(crate) fn split(data: &Measured, chosen: &[usize], options: &Options) -> (Vec<usize>, Vec<usize>) {
    deal::split(&data.group_of(), chosen, options.train_share, options.seed)
}

fn group_names(data: &Dataset) -> Vec<String> {
    let mut names: Vec<String> =
        data.trajectories().iter().map(|t| t.group().unwrap_or_default().to_string()).collect();
    names.sort();
    names.dedup();
    names
}

fn records(data: &Dataset, groups: &[String], name: &str) -> Result<Vec<Record>, DiscoveryError> {
    const COLUMNS: [&str; 5] = ["pusher_x_m", "pusher_y_m", "x_m", "y_m", "theta_rad"];
    let missing: Vec<&str> = COLUMNS.into_iter().filter(|c| !data.has_column(c)).collect();
    if !missing.is_empty() {
        return Err(DiscoveryError::NoPush { data: name.into(), missing: missing.join("`, `") });
    }
    let mut index = [0; 5];
    for (i, c) in index.iter_mut().zip(COLUMNS) {
        *i = data.column_index(c)?;
    }
    let flag = |name: &str| data.has_column(name).then(|| data.column_index(name)).transpose();
    let (rod_new, object_new) = (flag("pusher_new")?, flag("object_new")?);
    let mut all = Vec::new();
    for t in data.trajectories() {
        let fresh = |k: usize, flag: Option<usize>, columns: &[usize]| {
            flag.is_none_or(|f| t.column(f)[k] > 0.5) && columns.iter().all(|&c| t.column(c)[k].is_finite())
        };
        let mut r = Record {
            id: t.id().to_string(),
            rod_time: Vec::new(),
            rod_x: Vec::new(),
            rod_y: Vec::new(),
            corners: [const { Vec::new() }; 3],
            time: Vec::new(),
            pose: Vec::new(),
            group: groups.iter().position(|g| g == t.group().unwrap_or_default()).unwrap_or(0),
        };
        for (k, &time) in t.time_s().iter().enumerate() {
            if fresh(k, rod_new, &index[..2]) {
                r.rod_time.push(time);
                r.rod_x.push(t.column(index[0])[k]);
                r.rod_y.push(t.column(index[1])[k]);
            }
            if fresh(k, object_new, &index[2..]) {
                let [x, y, mut angle] = [2, 3, 4].map(|c| t.column(index[c])[k]);
                if let Some(before) = r.pose.last() {
                    let turn = std::f64::consts::TAU;
                    angle -= ((angle - before[2]) / turn).round() * turn;
                }
                r.time.push(time);
                r.pose.push([x, y, angle]);
            }
        }
        if r.time.len() >= 2 && r.rod_time.len() >= 2 {
            all.push(r);
        }
    }
    Ok(all)
}

fn check_contact(model: &PushModel, records: &[Record], name: &str) -> Result<(), DiscoveryError> {
    let (world, values) = model.world();
    let radius = values[augsim_physics::push::ROD_RADIUS];
    let mut closest = f64::INFINITY;
    for r in records {
        for (t, pose) in r.time.iter().zip(&r.pose) {
            let k = r.rod_time.partition_point(|&s| s <= *t).clamp(1, r.rod_time.len()) - 1;
            let (dx, dy) = (r.rod_x[k] - pose[0], r.rod_y[k] - pose[1]);
            let (s, c) = pose[2].sin_cos();
            let gap = world.object().outline.nearest([c * dx + s * dy, c * dy - s * dx]).distance - radius;
            closest = closest.min(gap);
        }
    }
    if closest < CONTACT_M {
        return Ok(());
    }
    Err(DiscoveryError::NoContact {
        data: name.into(),
        object: model.object.name.clone(),
        closest_m: closest,
    })
}

/// White noise from third differences of neighbouring fresh samples (their sum of squared weights is 20), by the median. The
/// declared accuracy of the instrument is a lower bound: a still marker scatters less than a moving one is wrong.
fn noise(model: &PushModel, records: &[Record], name: &str) -> Result<Noise, DiscoveryError> {
    let white = |c: usize| {
        let mut d: Vec<f64> = records
            .iter()
            .flat_map(|r| {
                r.pose.windows(4).map(move |w| (w[3][c] - 3.0 * w[2][c] + 3.0 * w[1][c] - w[0][c]).abs())
            })
            .collect();
        (d.len() >= FEWEST_DIFFERENCES).then(|| median(&mut d) / (0.674_489_75 * 20.0_f64.sqrt()))
    };
    let white = white(0).zip(white(1)).zip(white(2)).map(|((x, y), a)| {
        let position = (0.5 * (x * x + y * y)).sqrt();
        [position, position, a]
    });
    let declared = model.position_sd_m.zip(model.angle_sd_rad).map(|(p, a)| [p, p, a]);
    let mut findings = Vec::new();
    let sd = match (white, declared) {
        (None, None) => return Err(DiscoveryError::NoNoise { data: name.into(), model: model.file.clone() }),
        (Some(w), None) => w.map(|s| s.max(1e-7)),
        (None, Some(d)) => d,
        (Some(w), Some(d)) => {
            if (0..3).any(|c| (w[c] / d[c]).ln().abs() > 0.1) {
                findings.push("noise-scale".to_string());
            }
            // Close to what is declared the estimate is the better one; far below it something else than scatter was meant.
            [0, 1, 2].map(|c| if w[c] > 0.7 * d[c] { w[c] } else { d[c] })
        }
    };
    Ok(Noise { sd, white, findings })
}
