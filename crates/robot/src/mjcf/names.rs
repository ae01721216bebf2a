//! Names in an MJCF file: those of elements that others refer to, and those of elements that have none.

use std::collections::{BTreeMap, BTreeSet};

use crate::description::Robot;
use crate::xml::Element;

/// Names of bodies, geoms and sites, and names that are still to be given.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// Link of each body.
    pub bodies: BTreeMap<String, usize>,
    /// Link of each geom with a name.
    pub geoms: BTreeMap<String, usize>,
    /// Link of each site with a name.
    pub sites: BTreeMap<String, usize>,
    /// Links without a body of their own, with a proposed name.
    pub generated_links: Vec<(usize, String)>,
    /// Joints without an element of their own, with a proposed name.
    pub generated_joints: Vec<(usize, String)>,
    body_count: usize,
    joint_count: usize,
}

impl Names {
    /// Records the link of a geom or a site.
    pub fn record(&mut self, element: Element, link: usize) {
        let names = match element.tag() {
            "geom" => &mut self.geoms,
            "site" => &mut self.sites,
            _ => return,
        };
        if let Some(name) = element.attribute("name") {
            names.insert(name.into(), link);
        }
    }

    /// Name of the next body of the file: its own, or one by its number in MuJoCo.
    pub fn next_body(&mut self, element: Element) -> String {
        self.body_count += 1;
        element.attribute("name").map_or_else(|| format!("body{}", self.body_count), str::to_owned)
    }

    /// Name of the next joint of the file: its own, or one by its place in the file, from 1.
    pub fn next_joint(&mut self, element: Element) -> String {
        self.joint_count += 1;
        element.attribute("name").map_or_else(|| format!("joint{}", self.joint_count), str::to_owned)
    }

    /// Names the links and joints that have no element of their own, each unlike all others of the robot.
    pub fn give(&self, robot: &mut Robot) {
        let mut links: BTreeSet<String> = robot.links.iter().map(|link| link.name.clone()).collect();
        for (link, proposed) in &self.generated_links {
            robot.links[*link].name = choose(&mut links, proposed);
        }
        let mut joints: BTreeSet<String> = robot.joints.iter().map(|joint| joint.name.clone()).collect();
        for (joint, proposed) in &self.generated_joints {
            robot.joints[*joint].name = choose(&mut joints, proposed);
        }
    }
}

/// The proposed name, or else the first with a number behind it that is not taken.
fn choose(taken: &mut BTreeSet<String>, proposed: &str) -> String {
    let mut name = proposed.to_owned();
    let mut number = 1;
    while !taken.insert(name.clone()) {
        number += 1;
        name = format!("{proposed}_{number}");
    }
    name
}
