//! Contract: new values are put into the user's own text, of which everything else stays, and reading the result gives the
//! changed robot. Mechanism: exact texts of short files, and random changes of every fixture.

use augsim_robot::description::{Format, Inertia, Joint, JointKind};
use augsim_robot::{Changes, JointChange, Robot, read, write_back};
use proptest::prelude::*;

use crate::{FIXTURES, assert_close, fixture};

const INERTIA: Inertia =
    Inertia { mass_kg: 2.5, centre_m: [0.5, 0.0, -0.25], inertia_kg_m2: [1.0, 2.0, 2.5, 0.125, 0.0, -0.5] };

/// The text with changes that a function makes of the robot.
fn written(text: &str, change: impl FnOnce(&Robot) -> Changes) -> String {
    let robot = read(text, "arm").unwrap_or_else(|error| panic!("{error}"));
    write_back(text, &robot, &change(&robot)).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_urdf_file_keeps_its_comments_order_and_spacing() {
    let text = r#"<?xml version="1.0"?>
<!-- my arm -->
<robot name='r'>
  <link name="a"/>   <!-- base -->
  <joint name="j" type="continuous">
    <parent link="a"/> <child link="b"/>
  </joint>
  <link name="b">
    <inertial>
      <mass   value = "1.50" />
      <origin rpy="0 0 1" xyz="0.5 0 -0.25"/>
      <inertia ixx="1" iyy='2' izz="3" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="k" type="continuous"><parent link="b"/><child link="c"/><dynamics friction="3"/></joint>
  <link name="c"/>
</robot>
"#;
    let expected = r#"<?xml version="1.0"?>
<!-- my arm -->
<robot name='r'>
  <link name="a"/>   <!-- base -->
  <!-- joint j: stiffness 7, which URDF cannot state -->
  <joint name="j" type="continuous">
    <parent link="a"/> <child link="b"/>
    <dynamics damping="0.25"/>
  </joint>
  <link name="b">
    <inertial>
      <mass   value = "2.5" />
      <origin rpy="0 0 0" xyz="0.5 0 -0.25"/>
      <inertia ixx="1" iyy='2' izz="2.5" ixy="0.125" ixz="0" iyz="-0.5"/>
    </inertial>
  </link>
  <!-- joint k: backlash 0.01 rad - - see report -->
  <joint name="k" type="continuous"><parent link="b"/><child link="c"/><dynamics friction="4e-5" damping="0.5"/></joint>
  <link name="c">
    <inertial><origin xyz="0.5 0 -0.25" rpy="0 0 0"/><mass value="2.5"/><inertia ixx="1" iyy="2" izz="2.5" ixy="0.125" ixz="0" iyz="-0.5"/></inertial>
  </link>
</robot>
"#;
    let changed = written(text, |robot| Changes {
        inertias: vec![(robot.link("b").unwrap(), INERTIA), (robot.link("c").unwrap(), INERTIA)],
        joints: vec![
            (0, JointChange { damping: Some(0.25), stiffness: Some(7.0), ..JointChange::default() }),
            (1, JointChange { damping: Some(0.5), friction_loss: Some(4e-5), ..JointChange::default() }),
        ],
        notes: vec![(1, "backlash 0.01 rad -- see report".into())],
    });
    assert_eq!(changed, expected);
}

#[test]
fn an_mjcf_file_keeps_its_comments_order_and_spacing() {
    let text = r#"<mujoco>
  <worldbody>
    <!-- first body -->
    <body name="b" pos="0 0 1">
      <joint name="j" pos="0.5 0 0"/> <!-- shoulder -->
      <geom size="0.1"/>
      <body name="c">
        <inertial pos="1 0 0" mass="1" diaginertia="1 1 1" quat="1 0 0 0"/>
        <joint name="k" damping='3'/>
      </body>
    </body>
  </worldbody>
</mujoco>
"#;
    let expected = r#"<mujoco>
  <worldbody>
    <!-- first body -->
    <body name="b" pos="0 0 1">
      <inertial pos="1 0 -0.25" mass="2.5" fullinertia="1 2 2.5 0.125 0 -0.5"/>
      <!-- joint j: delay 4 ms -->
      <joint name="j" pos="0.5 0 0" armature="0.5"/> <!-- shoulder -->
      <geom size="0.1"/>
      <body name="c">
        <inertial pos="0.5 0 -0.25" mass="2.5" fullinertia="1 2 2.5 0.125 0 -0.5"/>
        <joint name="k" damping='1.5' stiffness="2"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"#;
    let changed = written(text, |robot| Changes {
        inertias: vec![(robot.link("b").unwrap(), INERTIA), (robot.link("c").unwrap(), INERTIA)],
        joints: vec![
            (0, JointChange { armature: Some(0.5), ..JointChange::default() }),
            (1, JointChange { damping: Some(1.5), stiffness: Some(2.0), ..JointChange::default() }),
        ],
        notes: vec![(0, "delay 4 ms".into())],
    });
    assert_eq!(changed, expected);
}

#[test]
fn no_change_gives_the_same_bytes() {
    for name in FIXTURES {
        let text = fixture(name);
        assert_eq!(written(&text, |_| Changes::default()), text, "{name}");
        let windows = text.replace('\n', "\r\n");
        assert_eq!(written(&windows, |_| Changes::default()), windows, "{name}");
    }
}

#[test]
fn new_lines_end_and_are_indented_like_those_of_the_file() {
    let text = "\u{feff}<robot name=\"r\">\r\n\t<link name=\"a\"/>\r\n\t<link name=\"b\"/>\r\n\
        \t<joint name=\"j\" type=\"continuous\">\r\n\t\t<parent link=\"a\"/>\r\n\t\t<child link=\"b\"/>\r\n\t</joint>\r\n</robot>";
    let changed = written(text, |_| Changes {
        joints: vec![(0, JointChange { damping: Some(2.0), ..JointChange::default() })],
        notes: vec![(0, "delay 4 ms".into())],
        ..Changes::default()
    });
    let expected = text
        .replace("\t<joint", "\t<!-- joint j: delay 4 ms -->\r\n\t<joint")
        .replace("<child link=\"b\"/>", "<child link=\"b\"/>\r\n\t\t<dynamics damping=\"2\"/>");
    assert_eq!(changed, expected);
}

#[test]
fn an_explicit_inertia_counts_although_geoms_took_its_place() {
    let text = r#"<mujoco><compiler inertiafromgeom="true"/><worldbody>
<body name="b"><inertial pos="0 0 0" mass="9" diaginertia="9 9 9"/><joint/><geom size="0.1"/></body>
<body name="c"><inertial pos="0 0 0" mass="9" diaginertia="9 9 9"/><joint/><geom size="0.1"/></body>
</worldbody></mujoco>"#;
    let changed = written(text, |_| Changes { inertias: vec![(1, INERTIA)], ..Changes::default() });
    let (before, after) = (read(text, "arm").unwrap(), read(&changed, "arm").unwrap());
    assert_eq!(after.links[1].inertia, Some(INERTIA));
    assert_eq!(after.links[2].inertia, before.links[2].inertia);
}

#[test]
fn changes_that_the_file_cannot_take_are_refused() {
    let text = r#"<mujoco><compiler settotalmass="3"/><worldbody><body name="b"><joint name="j"/><joint name="k"/><geom size="0.1"/><body name="c"/></body></worldbody></mujoco>"#;
    let robot = read(text, "arm.xml").unwrap();
    let refusal = |changes: Changes| write_back(text, &robot, &changes).unwrap_err().to_string();
    let inertia = |link| Changes { inertias: vec![(link, INERTIA)], ..Changes::default() };
    let joint = |joint, damping| {
        let change = JointChange { damping: Some(damping), ..JointChange::default() };
        Changes { joints: vec![(joint, change)], ..Changes::default() }
    };
    assert_eq!(
        refusal(inertia(9)),
        "arm.xml: the robot has no link 9; give an index below the number of links"
    );
    assert_eq!(
        refusal(joint(9, 0.0)),
        "arm.xml: the robot has no joint 9; give an index below the number of joints"
    );
    assert_eq!(
        refusal(joint(0, f64::NAN)),
        "arm.xml: a new value of joint `j` is not finite; leave this joint as it is"
    );
    assert_eq!(refusal(joint(2, 1.0)), "arm.xml: joint `c_fixed` does not move; leave this joint as it is");
    assert_eq!(
        refusal(inertia(1)),
        "arm.xml: link `b_j` has no <body> of its own, so that its inertia cannot be stated; change that of the body"
    );
    assert_eq!(
        refusal(inertia(2)),
        "arm.xml: settings of the file change the inertia of link `b` when it is read; remove settotalmass, boundmass, boundinertia and balanceinertia from <compiler>"
    );
    let twice = Changes { inertias: vec![(2, INERTIA), (2, INERTIA)], ..Changes::default() };
    assert_eq!(refusal(twice), "arm.xml: a link or a joint changes twice; give each one change");
    let other = Robot { joints: vec![], ..robot.clone() };
    assert_eq!(
        write_back(text, &other, &Changes::default()).unwrap_err().to_string(),
        "arm.xml: the file has other links and joints than the robot; give the file that was read"
    );
}

/// Values of a joint that a file of its format states.
fn stated(joint: &Joint, format: Format) -> Vec<f64> {
    let mut values = vec![joint.damping, joint.friction_loss, joint.reference, joint.spring_reference];
    if format == Format::Mjcf {
        values.extend([joint.armature, joint.stiffness]);
    }
    values
}

/// An inertia of a body: its tensor is that of three pairs of masses on turned axes.
fn inertias() -> impl Strategy<Value = Inertia> {
    let part = -0.5..0.5;
    let vector = move || prop::array::uniform3(part.clone());
    (1e-3..50.0, vector(), prop::array::uniform4(vector())).prop_map(
        |(mass_kg, centre_m, points): (f64, [f64; 3], [[f64; 3]; 4])| {
            let mut tensor = [1e-6; 6];
            tensor[3..].fill(0.0);
            for [x, y, z] in points {
                let parts = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z];
                tensor.iter_mut().zip(parts).for_each(|(sum, part)| *sum += mass_kg * part);
            }
            Inertia { mass_kg, centre_m, inertia_kg_m2: tensor }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn reading_the_written_file_gives_the_changed_robot(
        file in 0..FIXTURES.len(),
        drawn in prop::collection::vec(prop::option::of(inertias()), 12),
        values in prop::collection::vec(prop::array::uniform4(prop::option::of(0.0..20.0)), 12),
        note in ".{0,40}",
    ) {
        let text = fixture(FIXTURES[file]);
        let robot = read(&text, FIXTURES[file]).unwrap();
        let has_element = |link: usize| robot.links[link].name != "world" && !robot.links[link].name.starts_with("cardan_");
        let changes = Changes {
            inertias: drawn
                .iter()
                .enumerate()
                .filter(|(link, _)| *link < robot.links.len() && has_element(*link))
                .filter_map(|(link, inertia)| inertia.map(|inertia| (link, inertia)))
                .collect(),
            joints: values
                .iter()
                .enumerate()
                .filter(|(joint, _)| robot.joints.get(*joint).is_some_and(|joint| joint.kind != JointKind::Fixed))
                .map(|(joint, &[damping, friction_loss, armature, stiffness])| {
                    (joint, JointChange { damping, friction_loss, armature, stiffness })
                })
                .collect(),
            notes: vec![(0, note)],
        };
        let written = write_back(&text, &robot, &changes).unwrap();
        let reread = read(&written, FIXTURES[file]).unwrap();
        let expected = changes.apply(&robot);
        prop_assert_eq!(reread.links.len(), expected.links.len());
        for (link, expected) in reread.links.iter().zip(&expected.links) {
            assert_close(link.inertia.as_ref(), expected.inertia.as_ref());
        }
        for (joint, expected) in reread.joints.iter().zip(&expected.joints) {
            prop_assert_eq!(stated(joint, robot.format), stated(expected, robot.format));
            prop_assert_eq!(&joint.coupling, &expected.coupling);
            prop_assert_eq!(joint.placement, expected.placement);
        }
        prop_assert_eq!(&reread.unsupported.len(), &robot.unsupported.len());
        // All comments of the user are still there.
        for comment in text.split("<!--").skip(1) {
            let comment = comment.split("-->").next().unwrap();
            prop_assert!(written.contains(comment));
        }
    }
}
