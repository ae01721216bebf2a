//! Contract: the exported description is the user's file, with its comments, and moves as the model with its effects: exactly
//! where the identified inertias are those of real bodies, otherwise within the uncertainty of the identified combinations.
use super::description;
use augsim_equations::Model;
use augsim_equations::model::LINEAR_ENDINGS;
use augsim_robot::base_parameters::structurally_identifiable;
use augsim_robot::consistency::is_consistent;
use augsim_robot::description::{Format, Robot};
use augsim_robot::{Numbers, Tree, dynamic_parameters, inverse_dynamics, regressor};
use std::collections::BTreeMap;

const ARM: &str = r#"<?xml version="1.0"?>
<!-- the arm in the hall -->
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial> <!-- from CAD -->
      <origin xyz="0.02 0 0.2" rpy="0 0 0"/>
      <mass value="4"/>
      <inertia ixx="0.06" ixy="0" ixz="0.001" iyy="0.06" iyz="0" izz="0.01"/>
    </inertial>
  </link>
  <link name="fore">
    <inertial>
      <origin xyz="0 0.01 0.15" rpy="0 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.004"/>
    </inertial>
  </link>
  <link name="flange">
    <inertial>
      <origin xyz="0 0 0.02" rpy="0 0 0"/>
      <mass value="0.3"/>
      <inertia ixx="0.0004" ixy="0" ixz="0" iyy="0.0004" iyz="0" izz="0.0003"/>
    </inertial>
  </link>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <dynamics damping="0.5"/> <!-- guessed -->
  </joint>
  <joint name="bend" type="revolute">
    <parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="80" velocity="2"/>
  </joint>
  <joint name="hold" type="fixed">
    <parent link="fore"/><child link="flange"/><origin xyz="0 0 0.3" rpy="0 0 0.3"/>
  </joint>
</robot>
"#;

/// The model of the arm with these parameters, each without its unit, and more text at its end.
fn model(parameters: &str, torque_of_turn: &str, more: &str) -> Model {
    // Tests run in several threads of one process.
    let own = format!("augsim-export-robot-{}-{:?}", std::process::id(), std::thread::current().id());
    let folder = std::env::temp_dir().join(own);
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("arm.urdf"), ARM).expect("it can be written");
    let text = format!(
        "scenario = \"system\"\n[robot]\nfile = \"arm.urdf\"\njoints = [\"turn\", \"bend\"]\n\
         gravity_m_s2 = [0.0, 0.0, -9.81]\nposition = [\"q1_rad\", \"q2_rad\"]\nspeed = [\"w1_rad_s\", \"w2_rad_s\"]\n\
         acceleration = [\"a1_rad_s2\", \"a2_rad_s2\"]\n[inputs]\nq1_rad = {{}}\nq2_rad = {{}}\nw1_rad_s = {{}}\n\
         w2_rad_s = {{}}\na1_rad_s2 = {{}}\na2_rad_s2 = {{}}\n[parameters]\n{parameters}\n[outputs]\n\
         tau1_N_m = \"inverse_dynamics(turn){torque_of_turn}\"\ntau2_N_m = \"inverse_dynamics(bend)\"\n{more}"
    );
    let place = folder.join("model.toml").display().to_string();
    let model = augsim_equations::model::parse(&text, &place);
    std::fs::remove_dir_all(&folder).expect("it can be removed");
    model.unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Torques of rigid bodies at motions that fill the space of positions, speeds and accelerations.
fn torques(tree: &Tree, links: &[[f64; 10]]) -> Vec<f64> {
    let bodies = tree.body_parameters(&mut Numbers, links);
    let torques = (0..50).flat_map(|k| {
        let at = |root: f64, size: f64| size * (2.0 * (f64::from(k) * root).fract() - 1.0);
        let position = [at(2_f64.sqrt(), 3.0), at(3_f64.sqrt(), 2.0)];
        let speed = [at(5_f64.sqrt(), 2.0), at(7_f64.sqrt(), 2.0)];
        let acceleration = [at(11_f64.sqrt(), 10.0), at(13_f64.sqrt(), 10.0)];
        let gravity = [0.0, 0.0, -9.81];
        inverse_dynamics(&mut Numbers, tree, &bodies, gravity, &position, &speed, &acceleration)
    });
    torques.collect()
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|value| value * value).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Difference of the torques of a model and of a file, as a share of those of the model.
fn torque_difference(model: &Model, file: &Robot) -> f64 {
    let robot = model.robot.as_ref().expect("a robot");
    let properties = model.robot_properties(&model.nominals()).expect("a robot");
    let tree = Tree::new(file, &["turn".to_owned(), "bend".to_owned()], &BTreeMap::new()).expect("a tree");
    let expected = torques(&robot.tree, &properties.links);
    let written = torques(&tree, &tree.link_parameters(file));
    let difference = expected.iter().zip(&written).map(|(a, b)| a - b);
    root_mean_square(difference) / root_mean_square(expected.iter().copied())
}

fn assert_close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} differs from {b}");
}

fn read(text: &str) -> Robot {
    augsim_robot::read(text, "exported").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn possible_inertias_are_written_exactly_and_comments_stay() {
    let model = model(
        "upper_com_x_m = 0.03\nfore_mass_kg = 2.4\nfore_inertia_xx_kg_m2 = 0.023\nflange_moment_z_kg_m = 0.007",
        "",
        "",
    );
    for format in [Format::Urdf, Format::Mjcf] {
        let text = description(&model, format).expect("an export");
        let difference = torque_difference(&model, &read(&text));
        assert!(difference < 1e-9, "{difference}: {text}");
    }
    let text = description(&model, Format::Urdf).expect("an export");
    for kept in
        ["<!-- the arm in the hall -->", "<!-- from CAD -->", "<dynamics damping=\"0.5\"/> <!-- guessed -->"]
    {
        assert!(text.contains(kept), "`{kept}` is missing: {text}");
    }
    let unchanged = description(&self::model("upper_mass_kg = 4.0", "", ""), Format::Urdf);
    let without_note = unchanged.expect("an export");
    assert_eq!(without_note, ARM);
}

#[test]
fn effects_and_parameters_of_joints_become_attributes_or_comments() {
    let model = model(
        "turn_viscous = { nominal = 0.7, unit = \"N m s\" }\nbend_armature_kg_m2 = 0.05\ngain = 1.5",
        " + turn_viscous * w1_rad_s * gain / gain",
        "[[effect]]\nkind = \"linear-damping\"\non = \"turn\"\nc = 0.2\n\
         [[effect]]\nkind = \"coulomb\"\non = \"all joints\"\nf_turn = 3.0\nf_bend = 1.25\nw_turn = 0.05\nw_bend = 0.04\n\
         [[effect]]\nkind = \"rotor-inertia\"\non = \"bend\"\nJ = 0.02\n\
         [[effect]]\nkind = \"stribeck\"\non = \"bend\"\nf = 0.4\nw = 0.03\ns = 0.2\n\
         [[effect]]\nkind = \"payload\"\non = \"fore\"\nm = 1.5\np_x = 0.0\np_y = 0.15\np_z = 0.3\n",
    );
    let text = description(&model, Format::Mjcf).expect("an export");
    let robot = read(&text);
    let [turn, bend] = ["turn", "bend"].map(|name| &robot.joints[robot.joint(name).expect("a joint")]);
    assert_close(turn.damping, 0.9);
    assert_close(turn.friction_loss, 3.0);
    assert_close(bend.friction_loss, 1.25);
    assert_close(bend.armature, 0.07);
    let fore = robot.links[robot.link("fore").expect("a link")].inertia.expect("an inertia");
    assert_close(fore.mass_kg, 3.5);
    let difference = torque_difference(&model, &robot);
    assert!(difference < 1e-9, "{difference}: {text}");
    let urdf = description(&model, Format::Urdf).expect("an export");
    assert!(urdf.contains("armature 0.07, which URDF cannot state"), "{urdf}");
    for text in [text, urdf] {
        for words in ["effect stribeck", "f = 0.4 ", "s = 0.2 rad/s", "w_turn = 0.05 rad/s", "gain = 1.5"] {
            assert!(text.contains(words), "`{words}` is missing: {text}");
        }
    }
}

/// Parameters of a model whose combinations are those of the arm with other links, as a fit identifies them: one parameter
/// stands for each combination, and all others keep the values of the file. `lighten` changes the links.
fn combined(lighten: impl Fn(usize, &mut [f64; 10])) -> (String, Vec<String>) {
    let nominal = self::model("upper_mass_kg = 4.0", "", "");
    let robot = nominal.robot.as_ref().expect("a robot");
    let tree = &robot.tree;
    let file = tree.link_parameters(&robot.description);
    let mut links = file.clone();
    links.iter_mut().enumerate().for_each(|(k, link)| lighten(k, link));
    let names = vec![String::new(); 20];
    let base = structurally_identifiable(&names, &[[-3.0, 3.0], [-2.0, 2.0]], |q, w, a| {
        regressor(&mut Numbers, tree, [0.0, 0.0, -9.81], q, w, a).concat()
    });
    let bodies = |links: &[[f64; 10]]| tree.body_parameters(&mut Numbers, links).concat();
    let (found, declared) = (base.values(&bodies(&links)), base.values(&bodies(&file)));
    let mut text = String::new();
    let mut list = Vec::new();
    for (k, parameter) in base.independent.iter().enumerate() {
        // The first link of a body has the frame of the body.
        let (link, index) = (["upper", "fore"][parameter / 10], parameter % 10);
        let own = file[parameter / 10][index] + found[k] - declared[k];
        let name = format!("{link}_{}", LINEAR_ENDINGS[index]);
        text += &format!("{name} = {{ nominal = {own:?}, min = -100.0 }}\n");
        list.push(name);
    }
    (text, list)
}

/// A covariance in which each of these parameters has the standard deviation `sd`.
fn covariance(names: &[String], sd: f64) -> String {
    let row = |k: usize| -> Vec<String> {
        (0..names.len()).map(|i| if i == k { format!("{:?}", sd * sd) } else { "0.0".to_owned() }).collect()
    };
    let rows = names.iter().enumerate().map(|(k, name)| format!("{name} = [{}]\n", row(k).join(", ")));
    format!("[covariance]\n{}", rows.collect::<String>())
}

#[test]
fn combinations_of_another_arm_are_written_as_real_bodies_within_their_uncertainty() {
    // The true arm is lighter at the far end and has its mass elsewhere.
    let (parameters, names) = combined(|_, link| {
        let mut inertia = augsim_robot::inertia_of(link).expect("a mass");
        inertia.mass_kg *= 0.3;
        inertia.centre_m[0] += 0.04;
        inertia.inertia_kg_m2 = inertia.inertia_kg_m2.map(|moment| 0.2 * moment);
        *link = dynamic_parameters(&inertia);
    });
    let model = model(&parameters, "", &covariance(&names, 1e-4));
    let text = description(&model, Format::Urdf).expect("an export");
    assert!(text.contains("keep the identified combinations within their uncertainty"), "{text}");
    let robot = read(&text);
    for link in robot.links.iter().filter_map(|link| link.inertia.as_ref().map(dynamic_parameters)) {
        assert!(is_consistent(&link), "{link:?}");
    }
    // Torques of about 5 N m, from combinations with a standard deviation of 1e-4 kg m times 10 m/s2.
    let difference = torque_difference(&model, &robot);
    assert!(difference > 1e-9 && difference < 2e-3, "{difference}: {text}");
}

#[test]
fn combinations_of_no_arm_are_written_with_a_warning() {
    let (parameters, names) = combined(|k, link| {
        if k == 1 {
            link[7] = -0.3;
        }
    });
    let model = model(&parameters, "", &covariance(&names, 1e-4));
    let text = description(&model, Format::Urdf).expect("an export");
    assert!(text.contains("cannot have within their uncertainty"), "{text}");
}

#[test]
fn a_model_without_a_robot_is_refused_with_the_remedy() {
    let pendulum =
        augsim_equations::EXAMPLES.iter().find(|(name, _)| *name == "pendulum").expect("an example").1;
    let model = augsim_equations::model::parse(pendulum, "pendulum.toml").expect("an example");
    let error = description(&model, Format::Urdf).expect_err("it has no robot").to_string();
    assert!(error.contains("pendulum.toml") && error.contains("model from-robot"), "{error}");
}
