//! The arms of `reproduce robots`: their files, and how each is declared from them.

use super::declared::{Declared, request};
use super::published;
use super::simulated;
use augsim_data::{ColumnMapping, Dataset, MissingCells, RecognitionOptions, read_text, recognise};
use augsim_session::robot::{Free, RobotRequest};
use std::path::Path;

/// An arm with its data.
#[derive(Debug, Clone, Copy)]
pub struct Set {
    /// Name of the set, and of its folder in the results.
    pub name: &'static str,
    /// Name of the folder with the data; `None` for simulated data.
    pub folder: Option<&'static str>,
    /// Citation of the source of the data.
    pub source: &'static str,
    /// Declares the arm from the files of the folder; the error is the reason why it cannot be declared.
    pub declare: fn(&Path) -> Result<Declared, String>,
}

/// All arms of `reproduce robots`.
pub const SETS: [Set; 5] = [
    Set {
        name: "two-link-arm",
        folder: None,
        source: "simulated; the elbow has Coulomb friction that its description lacks, and the published values are the true ones",
        declare: |_| simulated::two_links(),
    },
    Set {
        name: "staubli-tx40",
        folder: Some("staubli-tx40"),
        source: "Nguyen, Vu, Gautier, Lamiraux: figaroh, examples/staubli_TX40; published values: its TX40_config.yaml",
        declare: tx40,
    },
    Set {
        name: "franka-excitation",
        folder: Some("franka-excitation"),
        source: "Gaz, Cognetti, Oliva, Robuffo Giordano, De Luca: Dynamic identification of the Franka Emika Panda robot, RA-L 2019; \
                 inertias of the manufacturer; its authors give friction as a sigmoid, which no parameter here corresponds to",
        declare: panda,
    },
    Set {
        name: "servo-horn",
        folder: Some("servo-horn"),
        source: "github mauicv/servo-sysid, MJCF model and runs of a position-controlled servo; no published values",
        declare: servo_horn,
    },
    Set {
        name: "robot-arm-axis1",
        folder: Some("robot-arm-axis1"),
        source: "Wernholt, Gunnarsson: Nonlinear identification of a physically parameterized robot model, SYSID 2006",
        declare: |_| {
            Err("its files describe no links or joints, and the log has speeds and torques but no positions; reproduce it as a \
                 system of equations"
                .to_owned())
        },
    },
];

/// Description of the Panda with the inertias of its manufacturer.
const PANDA: &str = include_str!("../../robots/panda.urdf");

fn log(path: &Path, columns: Vec<ColumnMapping>) -> Result<Dataset, String> {
    let reading = RecognitionOptions { columns, ..RecognitionOptions::default() };
    let read = recognise(&[path.to_path_buf()], &reading, MissingCells::AsGap);
    read.map(|read| read.data).map_err(|e| e.to_string())
}

fn text(path: &Path) -> Result<String, String> {
    read_text(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Declares the TX40. Its columns of angles are those of the motors, in rad, and its currents are motor torques in N m.
///
/// Gear ratios and the coupling of the wrist are those of the authors' program: motor 6 turns by the sum of joints 5 and 6.
fn tx40(folder: &Path) -> Result<Declared, String> {
    let column = |i: usize| ColumnMapping {
        from: format!("q{i}_deg"),
        to: format!("m{i}_rad"),
        unit: Some("rad".to_owned()),
    };
    let pairs = |list: [&str; 6]| -> Vec<(String, String)> {
        list.iter().enumerate().map(|(i, text)| (format!("joint_{}", i + 1), (*text).to_owned())).collect()
    };
    let free = Free { inertias: true, armature: true, viscous: true };
    let request = RobotRequest {
        positions: pairs([
            "m1_rad / 32",
            "m2_rad / 32 - pi / 2",
            "m3_rad / 45 + pi / 2",
            "-m4_rad / 48",
            "m5_rad / 45",
            "m6_rad / 32 - m5_rad / 45",
        ]),
        torques: pairs([
            "32 * current1_A",
            "32 * current2_A",
            "45 * current3_A",
            "-48 * current4_A",
            "45 * current5_A + 32 * current6_A",
            "32 * current6_A",
        ]),
        ..request("tx40.urdf", "data.csv.gz", free)
    };
    Ok(Declared {
        description: text(&folder.join("tx40_mdh_modified.urdf"))?,
        file: "tx40.urdf",
        log: log(&folder.join("data.csv.gz"), (1..=6).map(column).collect())?,
        request,
        published: published::tx40(&text(&folder.join("TX40_config.yaml"))?),
    })
}

/// Declares the Panda. Its inertias are free; friction is left to the search.
fn panda(folder: &Path) -> Result<Declared, String> {
    let free = Free { inertias: true, armature: false, viscous: false };
    Ok(Declared {
        description: PANDA.to_owned(),
        file: "panda.urdf",
        log: log(&folder.join("data.csv.gz"), Vec::new())?,
        request: request("panda.urdf", "data.csv.gz", free),
        published: Vec::new(),
    })
}

fn servo_horn(folder: &Path) -> Result<Declared, String> {
    Ok(Declared {
        description: text(&folder.join("robot.xml"))?,
        file: "robot.xml",
        log: log(&folder.join("data.csv.gz"), Vec::new())?,
        request: request("robot.xml", "data.csv.gz", Free::default()),
        published: Vec::new(),
    })
}
