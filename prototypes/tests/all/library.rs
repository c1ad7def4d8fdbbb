//! The library of a file.

use crate::loaded;
use rc_prototypes::model::Content;
use rc_prototypes::{COORDINATES, GEOMETRY, coordinate, listing, semantic};

#[test]
fn prototypes_of_an_interface_have_the_units_of_its_members() {
    let (library, found) = loaded(
        r#"import "Lidar.idsl";
        axes robocomp :: right, ahead, up
        algebraic named :: Scalar{x, y, z}
        dproto lidar_point :: geometry
        {
            semantic = Position   coord = cartesian   algebraic = named
            ddr = :: IDSL { RoboCompLidar::Point }
            dr = { X = x, Y = y, Z = z }
            axes = robocomp
        }
        dproto lidar_points :: geometry
        {
            semantic = PointSet   coord = cartesian   algebraic = named
            ddr = :: IDSL { RoboCompLidar::Scan }
            sequence = member points
            dr = { X = x, Y = y, Z = z }
            frames = { of = point, with_respect_to = member header.frame, stamp = member header.stamp }
            covariance = { member covariance }
            loss = 1e-3
        }"#,
    );
    assert_eq!(found, "");
    let axes = &library.axes[0];
    assert_eq!(axes.directions, "right, ahead, up");
    assert!(axes.is_right_handed);
    let point = library.prototype("lidar_point").expect("it");
    assert_eq!(point.axes.as_deref(), Some("robocomp"));
    let Content::Values { data, ty, .. } = &point.content else {
        panic!("no values");
    };
    assert_eq!(ty, "RoboCompLidar::Point");
    let numbers: Vec<_> = data
        .iter()
        .map(|d| (&*d.symbol, &*d.member, d.unit.as_deref()))
        .collect();
    let mm = Some("mm");
    assert_eq!(numbers, [("x", "X", mm), ("y", "Y", mm), ("z", "Z", mm)]);
    let points = library.prototype("lidar_points").expect("it");
    assert_eq!(points.sequence.as_deref(), Some("points"));
    assert_eq!(points.frames[1].1, "member header.frame");
    assert_eq!(points.loss, Some(1e-3));
    let covariance = points.covariance.as_ref().expect("one");
    assert_eq!(covariance.member, "covariance");
    assert_eq!((&covariance.order, &covariance.rotation), (&None, &None));
}

#[test]
fn relations_are_resolved() {
    let (library, found) = loaded(
        r#"import "common.dproto";
        units metres :: qudt, position3 { 0 = m, 1 = m, 2 = mm }
        alias position3 <-> position_named { 0 = X, 1 = Y, 2 = Z }
        dproto measured :: geometry
        {
            semantic = Position   coord = cartesian   algebraic = position3
            ddr = :: c99 { double[3] }
            dr = { 0 = 2, 1 = 1, 2 = 0 }
            units = metres
        }
        dproto matrix :: geometry
        {
            semantic = Pose   coord = homogeneous_transformation   algebraic = ht_matrix
            ddr = :: c99 { double[16] }
            dr = {
                0={0,0}, 1={0,1}, 2={0,2}, 3={0,3}, 4={1,0}, 5={1,1}, 6={1,2}, 7={1,3},
                8={2,0}, 9={2,1}, 10={2,2}, 11={2,3}, 12={3,0}, 13={3,1}, 14={3,2}, 15={3,3}
            }
        }
        view matrix.Position -> plain_position { {0,3} = 0, {1,3} = 1, {2,3} = 2 }
        domain soil :: { semantic = { Moisture }  coord = { percent } }
        algebraic one :: Vector{1}
        dproto wet :: soil
        {
            semantic = Moisture  coord = percent  algebraic = one  ddr = :: c99{float}  dr = { 0 = 0 }
        }
        dproto angles :: geometry
        {
            semantic = Orientation  coord = euler_zyx_moving  algebraic = position3
            ddr = :: c99{double[3]}  dr = { 0 = 0, 1 = 1, 2 = 2 }
        }
        conversion ros_quaternion -> angles = quat2euler
        fproto quat2euler :: c99 { library = "angles" args = { 1 <= ros_quaternion, 2 => angles } fname = "q2e" }
        load angles-c99"#,
    );
    assert_eq!(found, "");
    let Content::Values { data, .. } = &library.prototype("measured").expect("it").content else {
        panic!("no values");
    };
    let numbers: Vec<_> = data
        .iter()
        .map(|d| (&*d.symbol, &*d.member, d.unit.as_deref()))
        .collect();
    let expected = [
        ("0", "2", Some("m")),
        ("1", "1", Some("m")),
        ("2", "0", Some("mm")),
    ];
    assert_eq!(numbers, expected);
    assert_eq!(
        library.aliases[0].pairs[2],
        ("2".to_owned(), "Z".to_owned())
    );
    assert_eq!(
        library.views[0].pairs[0],
        ("{0,3}".to_owned(), "0".to_owned())
    );
    assert_eq!(library.conversions[0].function, "quat2euler");
    let Content::Parts(parts) = &library.prototype("ros_pose").expect("it").content else {
        panic!("no parts");
    };
    assert_eq!(parts[1].prototype, "ros_quaternion");
    assert_eq!(parts[1].member.as_deref(), Some("orientation"));
}

/// Each meaning names coordinates and parts that exist, in units that the table has.
#[test]
fn the_domain_fits_together() {
    for of in &GEOMETRY {
        assert!(rc_quantity::Unit::parse(of.unit).is_ok(), "{}", of.unit);
        for name in of.coordinates {
            assert!(coordinate(name).is_some(), "{name}");
        }
        for (_, part) in of.parts {
            assert!(semantic(part).is_some(), "{part}");
        }
    }
    for unit in COORDINATES
        .iter()
        .flat_map(|of| of.values)
        .filter_map(|(_, unit)| *unit)
    {
        assert!(rc_quantity::Unit::parse(unit).is_ok(), "{unit}");
    }
    let rotation = semantic("Orientation").expect("it");
    assert!(rotation.has("euler_zyz_fixed"));
    assert!(
        !rotation.has("euler_rpy")
            && !rotation.has("euler_zzz_fixed")
            && !rotation.has("cartesian")
    );
    let text = listing();
    for of in &GEOMETRY {
        assert!(text.contains(&format!("    {}", of.name)), "{}", of.name);
    }
}
