//! Printed functions beside Eigen, over its memory and that of structures of C.

use crate::functions::{compile, written};
use crate::library;
use rc_plans::{Network, c};
use rc_test_support::{debian, python};
use std::path::{Path, PathBuf};
use std::process::Command;

const PROTOTYPES: &str = r#"
axes ros :: ahead, left, up
axes optical :: right, down, ahead
algebraic v3 :: Vector{3}
algebraic v4 :: Vector{4}
algebraic v16 :: Vector{16}
algebraic m33 :: Matrix{3, 3}
units metres :: qudt, v3 { 0 = m, 1 = m, 2 = m }
units millimetres :: qudt, v3 { 0 = mm, 1 = mm, 2 = mm }
dproto place :: geometry { semantic = Position coord = cartesian algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } units = metres axes = ros }
dproto coefficients :: geometry { semantic = Orientation coord = quaternion algebraic = v4 ddr = :: Eigen{Quaterniond} dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3 } axes = ros }
dproto turn :: geometry { semantic = Orientation coord = axis_angle algebraic = v4 ddr = :: c99{double[4]} dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3 } axes = ros }
dproto yaw_pitch_roll :: geometry { semantic = Orientation coord = euler_zyx_moving algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } axes = ros }
dproto rotation :: geometry { semantic = Orientation coord = rot_matrix algebraic = m33 ddr = :: Eigen{RowMajor} dr = { MATRIX } axes = ros }
dproto isometry :: geometry { semantic = Pose coord = homogeneous_row_vectors algebraic = v16 ddr = :: Eigen{Isometry3d} dr = { COLUMNS } axes = ros }
dproto pose :: geometry { semantic = Pose composes = { Position = place, Orientation = coefficients } }
dproto place_mm :: geometry { semantic = Position coord = cartesian algebraic = v3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } units = millimetres axes = optical }
dproto seen :: geometry { semantic = Orientation coord = rot_matrix algebraic = m33 ddr = :: c99{double[9]} dr = { MATRIX } axes = optical }
dproto optical :: geometry { semantic = Pose composes = { Position = place_mm, Orientation = seen } }
"#;

/// The functions of the program.
const PLANS: [(&str, &str); 9] = [
    ("pose", "isometry"),
    ("isometry", "pose"),
    ("coefficients", "rotation"),
    ("rotation", "coefficients"),
    ("coefficients", "turn"),
    ("turn", "coefficients"),
    ("coefficients", "yaw_pitch_roll"),
    ("pose", "optical"),
    ("optical", "isometry"),
];

/// The headers of Eigen: of the system, or of a package of Debian unpacked in a folder.
fn headers(place: Option<&Path>) -> PathBuf {
    place.unwrap_or(Path::new("/")).join("usr/include/eigen3")
}

#[test]
fn eigen_reads_what_printed_functions_write() {
    let test = "eigen_reads_what_printed_functions_write";
    let works = |place: Option<&Path>| headers(place).join("Eigen/Geometry").is_file();
    let place = match debian::provided("libeigen3-dev --no-install-recommends", &works) {
        Ok(place) => place,
        Err(reason) => return python::skipped(test, &reason),
    };
    if Command::new("c++").arg("--version").output().is_err() {
        return python::skipped(test, "there is no `c++`");
    }
    let matrix: Vec<String> = (0..9)
        .map(|at| format!("{at} = {{{},{}}}", at / 3, at % 3))
        .collect();
    let columns: Vec<String> = (0..16).map(|at| format!("{at} = {at}")).collect();
    let text = PROTOTYPES
        .replace("MATRIX", &matrix.join(", "))
        .replace("COLUMNS", &columns.join(", "));
    let library = library(&text);
    let network = Network::new(&library);
    let functions = PLANS.map(|(from, to)| c(&network.plan(from, to).expect("a plan")));
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let source = written(folder, "functions.c", &functions.concat());
    let object = folder.join("functions.o");
    let mut compiler = Command::new("cc");
    compiler
        .args(["-std=c99", "-ffp-contract=off", "-c"])
        .arg(&source);
    let output = compiler
        .arg("-o")
        .arg(&object)
        .output()
        .expect("a compiler");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let main = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/eigen.cpp");
    let mut compiler = Command::new("c++");
    compiler.args(["-std=c++17", "-O0", main]).arg(&object);
    compiler.arg("-isystem").arg(headers(place.as_deref()));
    let program = compile(&mut compiler, folder);
    let output = Command::new(program).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}");
    assert_eq!(said, "11000", "comparisons");
}
