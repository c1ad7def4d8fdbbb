//! Errors in files, with their places.

use crate::loaded;
use expect_test::{Expect, expect};
use rc_prototypes::model::Content;

/// The findings of a file that imports `common.dproto`.
fn check(text: &str, expected: &Expect) {
    let (_, found) = loaded(&format!("import \"common.dproto\";\n{text}"));
    expected.assert_eq(&found);
}

/// Listing 10 of the paper has the values 3 and 4 of a `Vector{4}`.
#[test]
fn an_alias_names_each_value_once() {
    check(
        "alias quat_named <-> quat { x=0, y=1, z=3, w=4 }",
        &expect![[r#"
            a.dproto:2:27: error[missing-symbol]: the map lacks `2` of quat
            a.dproto:2:46: error[unknown-symbol]: quat has no value `4` (expected one of `0`, `1`, `2`, `3`)
        "#]],
    );
}

/// The order of aliases does not decide what a number is.
#[test]
fn aliases_that_contradict_each_other_are_refused() {
    let aliases = [
        "alias four <-> real_last { 0 = x 1 = y 2 = z 3 = w }\n",
        "alias four <-> real_first { 0 = w 1 = x 2 = y 3 = z }\n",
    ];
    let rest = "algebraic four :: Vector{4}
algebraic real_last :: Scalar{x, y, z, w}
algebraic real_first :: Scalar{w, x, y, z}
dproto one :: geometry { semantic = Orientation coord = quaternion algebraic = four ddr = :: c99{double[4]} dr = { 0 = 0, 1 = 1, 2 = 2, 3 = 3 } }
";
    for texts in [[aliases[0], aliases[1]], [aliases[1], aliases[0]]] {
        let (_, found) = loaded(&[texts[0], texts[1], rest].concat());
        let message = "error[wrong-algebraic]: an abstract type for `quaternion` has one order of its values; its \
                       aliases give several";
        assert!(found.contains(message), "{found}");
    }
    for alias in aliases {
        assert_eq!(loaded(&[alias, rest].concat()).1, "");
    }
}

/// Listing 5 of the paper has the unit first.
#[test]
fn units_name_each_value_once() {
    check(
        "units metres :: qudt, position_named {m = X, m = Y, m = Z}\nunits odd :: qudt, position3 { 0 = banana }\nunits own :: si, position { 0 = m }",
        &expect![[r#"
            a.dproto:2:39: error[unknown-symbol]: position_named has no value `m` (expected one of `X`, `Y`, `Z`)
            a.dproto:2:46: error[repeated-key]: `m` is given twice; first named here at a.dproto:2:39
            a.dproto:2:53: error[repeated-key]: `m` is given twice; first named here at a.dproto:2:39
            a.dproto:3:36: warning[unknown-unit]: unknown unit `banana`
            a.dproto:4:14: error[unknown-vocabulary]: unknown vocabulary of units `si` (write `qudt`)
            a.dproto:4:18: error[unknown-algebraic]: unknown abstract type `position` (did you mean `position3`?)
        "#]],
    );
}

/// Listing 8 of the paper names Z twice, and one value not at all.
#[test]
fn a_view_names_all_values_of_its_part() {
    check(
        "dproto pose2 :: geometry { semantic = Pose coord = homogeneous_transformation algebraic = ht_matrix ddr = :: c99{double[16]} dr = {
0={0,0}, 1={0,1}, 2={0,2}, 3={0,3}, 4={1,0}, 5={1,1}, 6={1,2}, 7={1,3}, 8={2,0}, 9={2,1}, 10={2,2}, 11={2,3}, 12={3,0}, 13={3,1}, 14={3,2}, 15={3,3} } }
view pose2.Position -> ros_position { {3,0} = X, {3,1} = Z, {3,2} = Z }
view pose2.Position -> ros_position { {0,0} = X, {0,1} = Y, {2,3} = Z }
view pose2.Orientation -> ros_quaternion { {0,0} = x, {0,1} = y, {0,2} = z, {1,0} = w }
view pose2.Orientation -> ros_position { {3,0} = X, {3,1} = Y, {3,2} = Z }
view pose2.Wheel -> ros_position { {3,0} = X, {3,1} = Y, {3,2} = Z }
view ros_pose.Position -> ros_position { {4,0} = X }",
        &expect![[r#"
            a.dproto:4:37: error[missing-symbol]: the map lacks `Y` of position_named
            a.dproto:4:39: error[wrong-view]: in homogeneous_transformation, `X` is `{0,3}`
            a.dproto:4:50: error[wrong-view]: in homogeneous_transformation, `Z` is `{2,3}`
            a.dproto:4:69: error[repeated-key]: `Z` is given twice; first named here at a.dproto:4:58
            a.dproto:5:39: error[wrong-view]: in homogeneous_transformation, `X` is `{0,3}`
            a.dproto:5:50: error[wrong-view]: in homogeneous_transformation, `Y` is `{1,3}`
            a.dproto:6:27: error[wrong-view]: the Orientation in homogeneous_transformation is not quaternion (a homogeneous matrix holds a position as `cartesian`, an orientation as `rot_matrix`)
            a.dproto:7:27: error[semantic-mismatch]: `ros_position` is Position, the part is Orientation
            a.dproto:8:12: error[unknown-part]: Pose has no part `Wheel` (expected one of `Position`, `Orientation`)
            a.dproto:9:6: error[wrong-type]: `ros_pose` composes others; a view needs values
        "#]],
    );
}

#[test]
fn only_members_are_opposites() {
    check(
        "dproto a :: geometry { semantic = Position coord = cartesian algebraic = position3 ddr = point dr = { X = -0, Y = 1, Z = 2 } }
alias position3 <-> position_named { 0 = -X, 1 = Y, 2 = Z }",
        &expect![[r#"
            a.dproto:3:42: error[wrong-entry]: only members of `dr` are the opposite of a value
        "#]],
    );
}

#[test]
fn wrong_fields_are_findings() {
    check(
        "dproto a :: geometry { semantic = Position coord = cartesian ddr = point dr = { x = X } }
dproto b :: geometry { semantic = Position coord = quaternion algebraic = position3 ddr = point dr = { 0 = 0, 1 = 1, 2 = 2 } }
dproto c :: geometri { semantic = Position }
dproto d :: geometry { semantic = Positon }
dproto e :: geometry { coord = cartesian colour = red coord = polar }
dproto f :: geometry { semantic = Orientation coord = quaternion algebraic = position3 ddr = point dr = { 0 = 0, 1 = 1, 2 = 2 } }
dproto g :: geometry { semantic = Position coord = cartesian algebraic = position3 ddr = piont dr = { 0 = 0, 1 = 1, 2 = 2 } }
dproto h :: geometry { semantic = Position coord = cartesian algebraic = position3 ddr = point dr = { x = 0, x = 1, y } tolerance = \"wide\" axes = robocomp }
dproto i :: geometry { semantic = Pose composes = { Position = ros_quaternion, Orientation = nothing } coord = cartesian }
dproto j :: geometry { semantic = Pose composes = { Position = ros_position } }
dproto ros_pose :: geometry { }",
        &expect![[r#"
            a.dproto:2:8: error[missing-field]: `a` has no field `algebraic` (add `algebraic = …`)
            a.dproto:3:52: error[unknown-coordinate]: Position has no coordinates `quaternion` (expected one of `cartesian`, `polar`, `cylindrical`, `spherical`)
            a.dproto:4:13: error[unknown-domain]: unknown domain `geometri` (did you mean `geometry`?)
            a.dproto:5:35: error[unknown-semantic]: `geometry` has no meaning `Positon` (did you mean `Position`?)
            a.dproto:6:8: error[missing-field]: `e` has no field `semantic` (add `semantic = …`)
            a.dproto:6:42: error[unknown-field]: unknown field `colour` (expected one of `semantic`, `coord`, `algebraic`, `ddr`, `dr`, `units`, `composes`, `usingddr`, `axes`, `body`, `frames`, `sequence`, `covariance`, `tolerance`, `loss`)
            a.dproto:6:55: error[repeated-key]: `e` already has a field `coord`; first given here at a.dproto:6:24
            a.dproto:7:78: error[wrong-count]: `quaternion` has 4 values, `position3` has 3
            a.dproto:8:90: error[unknown-type]: unknown type `piont` (did you mean `point`?)
            a.dproto:9:110: error[repeated-key]: `x` is given twice; first named here at a.dproto:9:103
            a.dproto:9:117: error[wrong-entry]: expected `y = VALUE`
            a.dproto:9:121: error[conflicting-fields]: Position has no `tolerance`
            a.dproto:9:133: error[wrong-value]: `tolerance` is a number of at least 0
            a.dproto:9:147: error[unknown-axes]: unknown axes `robocomp`
            a.dproto:10:8: error[conflicting-fields]: `i` composes others; it has no `coord`
            a.dproto:10:64: error[semantic-mismatch]: `ros_quaternion` is Orientation, the part is Position
            a.dproto:10:94: error[unknown-prototype]: unknown prototype `nothing` (expected one of `a`, `b`, `c`, `d`, `e`, `f`, `g`, `h`, `i`, `j`, `plain_position`, `ros_pose`, `ros_position`, `ros_quaternion`)
            a.dproto:11:51: error[missing-symbol]: the map lacks `Orientation` of Pose
            a.dproto:12:8: error[duplicate-name]: `ros_pose` is declared twice; first declared here at common.dproto:34:8
        "#]],
    );
}

#[test]
fn wrong_declarations_are_findings() {
    check(
        "axes bent :: right, left, up
algebraic huge :: Vector{4294967296}
algebraic wide :: Matrix{100, 100}
algebraic twice :: Scalar{x, x}
domain geometry :: { semantic = { A } coord = { b } }
conversion ros_position -> ros_quaternion = f
conversion ros_position -> other = f
dproto a :: geometry { semantic = PairPose composes = { Obj1 = b, Obj2 = ros_pose } }
dproto b :: geometry { semantic = PairPose composes = { Obj1 = a, Obj2 = ros_pose } }
dprot c :: geometry { }
alias position3 <- position_named { 0 = X }
dproto d :: geometry { semantic Position }",
        &expect![[r#"
            a.dproto:2:1: error[bad-axes]: expected the directions of x, y and z along three lines, as in `ahead, left, up`; there are ahead, back, left, right, up and down
            a.dproto:3:26: error[bad-length]: expected a number from 1 to 1024
            a.dproto:4:26: error[bad-length]: a matrix has at most 1024 numbers
            a.dproto:5:30: error[repeated-key]: `x` is given twice
            a.dproto:6:8: error[reserved-name]: the domain `geometry` comes with the tools
            a.dproto:7:28: error[semantic-mismatch]: `ros_position` is Position, `ros_quaternion` is Orientation
            a.dproto:8:28: error[unknown-prototype]: unknown prototype `other` (expected one of `a`, `b`, `plain_position`, `ros_pose`, `ros_position`, `ros_quaternion`)
            a.dproto:9:8: error[circular-prototypes]: `a` composes itself
            a.dproto:9:64: error[semantic-mismatch]: `b` is PairPose, the part is Pose
            a.dproto:10:8: error[circular-prototypes]: `b` composes itself
            a.dproto:10:64: error[semantic-mismatch]: `a` is PairPose, the part is Pose
            a.dproto:11:1: error[unknown-declaration]: expected a declaration, found `dprot` (did you mean `dproto`?)
            a.dproto:12:17: error[syntax-error]: expected `<->`, found `<`
            a.dproto:13:33: error[syntax-error]: expected `=`, found `Position`
        "#]],
    );
}

#[test]
fn an_interface_has_the_members_that_a_prototype_names() {
    let head = "import \"Lidar.idsl\";\nalgebraic named :: Scalar{x, y, z}\n";
    let (_, found) = loaded(&format!(
        "{head}dproto a :: geometry {{ semantic = Position coord = cartesian algebraic = named ddr = :: IDSL{{RoboCompLidar::Pont}} dr = {{ X = x, Y = y, Z = z }} }}
dproto b :: geometry {{ semantic = Position coord = cartesian algebraic = named ddr = :: IDSL{{RoboCompLidar::Point}} dr = {{ x = x, Y = y, Z = z }} frames = {{ of = member frame }} }}
dproto c :: geometry {{ semantic = LinearVelocity coord = cartesian algebraic = named ddr = :: IDSL{{RoboCompLidar::Point}} dr = {{ X = x, Y = y, Z = z }} }}
dproto d :: geometry {{ semantic = PointSet coord = cartesian algebraic = named ddr = :: IDSL{{RoboCompLidar::Scan}} dr = {{ header = x, Y = y, Z = z }} sequence = member header }}
dproto e :: geometry {{ semantic = PointSet coord = cartesian algebraic = named ddr = :: IDSL{{RoboCompLidar::Scan}} dr = {{ covariance.0 = x, covariance.1 = y, covariance.36 = z }} }}"
    ));
    expect![[r#"
        a.dproto:3:94: error[unknown-type]: unknown type `RoboCompLidar::Pont` (did you mean `RoboCompLidar::Point`?)
        a.dproto:4:123: error[unknown-member]: the type has no member `x` (did you mean `X`?)
        a.dproto:4:161: error[unknown-member]: the type has no member `frame` (expected one of `X`, `Y`, `Z`, `intensity`)
        a.dproto:5:129: error[wrong-units]: `X` is in mm, which is not a unit of m/s
        a.dproto:5:136: error[wrong-units]: `Y` is in mm, which is not a unit of m/s
        a.dproto:5:143: error[wrong-units]: `Z` is in mm, which is not a unit of m/s
        a.dproto:6:122: error[wrong-type]: `header` is not a number
        a.dproto:6:134: error[unknown-member]: the type has no member `Y` (expected one of `header`, `points`, `covariance`, `wide`)
        a.dproto:6:141: error[unknown-member]: the type has no member `Z` (expected one of `header`, `points`, `covariance`, `wide`)
        a.dproto:6:160: error[wrong-type]: `header` is not a sequence
        a.dproto:7:8: error[missing-field]: `e` has no field `sequence` (add `sequence = …`)
        a.dproto:7:158: error[unknown-member]: the type has no member `36`
    "#]].assert_eq(&found);
}

/// Time and memory of compositions are bounded.
#[test]
fn deep_compositions_are_refused() {
    let pairs: String = (1..40)
        .map(|at| {
            let part = at - 1;
            format!("dproto p{at} :: deep {{ semantic = Both composes = {{ Both = p{part} }} }}\n")
        })
        .collect();
    let text = format!(
        "import \"common.dproto\";\ndomain deep :: {{ semantic = {{ Both }} coord = {{ any }} }}
dproto p0 :: deep {{ semantic = Both coord = any algebraic = position3 ddr = point dr = {{ x = 0, y = 1, z = 2 }} }}
{pairs}"
    );
    let (_, found) = loaded(&text);
    assert!(found.contains("error[nested-too-deep]"), "{found}");
    assert_eq!(found.lines().count(), 23, "{found}");
}

/// The names of an abstract type say which coordinates its values are: others are refused, not
/// taken in some order.
#[test]
fn an_abstract_type_fits_its_coordinates() {
    let line = |name: &str, semantic: &str, coord: &str, algebraic: &str, symbols: &[&str]| {
        let pairs: Vec<String> = symbols
            .iter()
            .enumerate()
            .map(|(at, symbol)| format!("{at} = {symbol}"))
            .collect();
        format!(
            "dproto {name} :: geometry {{ semantic = {semantic} coord = {coord} algebraic = {algebraic} \
             ddr = :: c99{{double[16]}} dr = {{ {} }} }}\n",
            pairs.join(", ")
        )
    };
    let angles = ["roll", "pitch", "yaw"];
    let nine: Vec<String> = (0..9).map(|at| format!("{{0,{at}}}")).collect();
    let nine: Vec<&str> = nine.iter().map(String::as_str).collect();
    let text = [
        "algebraic xz :: Scalar{x, z}\nalgebraic xy :: Scalar{Y, X}\nalgebraic twice :: Scalar{x, X}\nalgebraic two :: Vector{2}\nalgebraic angles :: Scalar{roll, pitch, yaw}\nalgebraic real :: Scalar{re, i, j, k}\nalgebraic row :: Matrix{1, 9}\nalgebraic square :: Matrix{2, 2}\nalgebraic also_real :: Scalar{re, i, j, k}\nalias also_real <-> quat_named { re = w, i = x, j = y, k = z }\n".to_owned(),
        line("a", "AngularVelocity", "cartesian", "two", &["0", "1"]),
        line("b", "Torque", "cartesian", "xy", &["X", "Y"]),
        line("c", "Position", "cartesian", "xz", &["x", "z"]),
        line("d", "Position", "cartesian", "xy", &["X", "Y"]),
        line("e", "Orientation", "euler_zyx_moving", "angles", &angles),
        line("f", "Orientation", "rpy", "angles", &angles),
        line("g", "Orientation", "quaternion", "real", &["re", "i", "j", "k"]),
        line("h", "Orientation", "quaternion", "also_real", &["re", "i", "j", "k"]),
        line("i", "Orientation", "rot_matrix", "row", &nine),
        line("k", "Position", "cartesian", "twice", &["x", "X"]),
        line("j", "Orientation", "quaternion", "square", &["{0,0}", "{0,1}", "{1,0}", "{1,1}"]),
    ];
    check(
        &text.concat(),
        &expect![[r#"
            a.dproto:12:81: error[wrong-count]: `cartesian` has 3 values, `two` has 2
            a.dproto:13:72: error[wrong-count]: `cartesian` has 3 values, `xy` has 2
            a.dproto:14:74: error[wrong-algebraic]: an abstract type for `cartesian` has the names `x`, `y`
            a.dproto:16:84: error[wrong-algebraic]: an abstract type for `euler_zyx_moving` has the names `first`, `second`, `third`
            a.dproto:18:78: error[wrong-algebraic]: an abstract type for `quaternion` has the names `x`, `y`, `z`, `w`
            a.dproto:20:78: error[wrong-algebraic]: an abstract type for `rot_matrix` has 3 rows and 3 columns
            a.dproto:21:74: error[wrong-algebraic]: an abstract type for `cartesian` has the names `x`, `y`
            a.dproto:22:78: error[wrong-algebraic]: an abstract type for `quaternion` has the names `x`, `y`, `z`, `w`, or is a `Vector`
        "#]],
    );
    let (library, _) = loaded(&format!("import \"common.dproto\";\n{}", text.concat()));
    let roles = |name: &str| {
        let Content::Values { data, .. } = &library.prototype(name).expect("it").content else {
            panic!("no values");
        };
        let roles: Vec<&str> = data.iter().map(|datum| datum.role.as_str()).collect();
        roles.join(" ")
    };
    assert_eq!(roles("d"), "y x");
    assert_eq!(roles("f"), "roll pitch yaw");
    assert_eq!(roles("h"), "w x y z");
}

/// No unit of time follows a number here, and `<` of `<=` opens no bracket.
#[test]
fn numbers_and_arrows_are_no_findings() {
    let many: String = (0..101)
        .map(|at| {
            format!(
                "fproto f{at} :: c99 {{ library = \"l\" fname = \"f\" \
                 args = {{ 1 <= ros_pose, 2 => ros_pose }} }}\n"
            )
        })
        .collect();
    let text = format!(
        "algebraic two :: Vector{{2}}\nalgebraic sm :: Scalar{{s, m}}\nalias sm <-> two {{ s = 0 m = 1 }}
load 3rdparty-c99\nddr near :: ROS{{my/3d/Point}}\n{many}"
    );
    check(&text, &expect![[""]]);
}

#[test]
fn fields_that_say_nothing_are_findings() {
    check(
        "algebraic one :: Vector{1}\naxes ros :: ahead, left, up
dproto a :: geometry { semantic = TimeStamp coord = seconds algebraic = one ddr = :: c99{double} dr = { 0 = 0 } axes = ros tolerance = 1 sequence = member x covariance = { member c } }
dproto b :: geometry { semantic = Orientation coord = euler_rpy algebraic = position3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } }
dproto c :: geometry { semantic = Orientation coord = rpy algebraic = position3 ddr = :: c99{double[3]} dr = { 0 = 0, 1 = 1, 2 = 2 } tolerance = \"0.5\" covariance = { member c, order = xyz_rpy, rotation = fixed, rotation = moving } }
dproto d :: geometry { semantic = Pose composes = { Position = ros_position, Orientation = ros_quaternion } covariance = { member c, order = xyz, rotation = fixed, colour = red } }
dproto e :: geometry { semantic = Pose composes = { Position = ros_position, Orientation = ros_quaternion } covariance = { } }
dproto f :: geometry { semantic = Pose composes = { Position = ros_position, Orientation = ros_quaternion } covariance = { member c = z } }
dproto g :: geometry { semantic = Pose composes = { Position = ros_position, Orientation = ros_quaternion } covariance = { member c, order = rpy_xyz, rotation = moving } tolerance = 0.1 }",
        &expect![[r#"
            a.dproto:4:8: error[wrong-value]: `tolerance` of `a` must be below 1
            a.dproto:4:113: error[conflicting-fields]: TimeStamp has no `axes`
            a.dproto:4:124: error[conflicting-fields]: TimeStamp has no `tolerance`
            a.dproto:4:138: error[conflicting-fields]: TimeStamp has no `sequence`
            a.dproto:4:158: error[conflicting-fields]: TimeStamp has no `covariance`
            a.dproto:5:55: error[unknown-coordinate]: Orientation has no coordinates `euler_rpy` (expected one of `quaternion`, `quaternion_wxyz`, `rot_matrix`, `rpy`, `axis_angle`, `rotation_vector`, `euler_zyx_moving`, `euler_zyz_fixed`)
            a.dproto:6:146: error[wrong-value]: `tolerance` is a number of at least 0
            a.dproto:6:177: error[conflicting-fields]: the covariance of Orientation has no `order`
            a.dproto:6:212: error[repeated-key]: `rotation` is given twice; first named here at a.dproto:6:194
            a.dproto:7:142: error[wrong-entry]: expected `xyz_rpy` or `rpy_xyz`
            a.dproto:7:165: error[unknown-symbol]: covariance has no value `colour` (expected one of `order`, `rotation`)
            a.dproto:8:122: error[wrong-entry]: expected `member NAME` first
            a.dproto:9:124: error[wrong-entry]: expected `member NAME` first
        "#]],
    );
    let (_, found) = loaded("import \"Lidar.idsl\";\nalgebraic named :: Scalar{x, y, z}
dproto a :: geometry { semantic = PointSet coord = cartesian algebraic = named ddr = :: IDSL{RoboCompLidar::Scan} sequence = member points dr = { X = x, Y = y, Z = z } covariance = { member wide } }");
    expect![[r#"
        a.dproto:3:184: error[wrong-count]: the covariance of PointSet has 9 numbers, `wide` has 36
    "#]]
    .assert_eq(&found);
}

#[test]
fn parts_of_one_type_have_members_of_their_own() {
    let pose = |first: u32, sure: &str| {
        let turn = format!("{first} = 0, {} = 1, {} = 2", first + 1, first + 2);
        format!(
            "algebraic three :: Vector{{3}}
dproto place :: geometry {{ semantic = Position coord = cartesian algebraic = three ddr = :: c99{{double[9]}} dr = {{ 0 = 0, 1 = 1, 2 = 2 }} {sure} }}
dproto turn :: geometry {{ semantic = Orientation coord = rpy algebraic = three ddr = :: c99{{double[9]}} dr = {{ {turn} }} {sure} }}
dproto pose :: geometry {{ semantic = Pose composes = {{ Position = place, Orientation = turn }} ddr = :: c99{{double[9]}} }}"
        )
    };
    check(&pose(3, ""), &expect![[""]]);
    check(
        &pose(2, ""),
        &expect![[r#"
        a.dproto:5:8: error[repeated-key]: two parts of `pose` name the member `2`
    "#]],
    );
    check(
        &pose(3, "covariance = { member c }"),
        &expect![[r#"
        a.dproto:5:8: error[repeated-key]: two parts of `pose` name the member `c`
    "#]],
    );
}
