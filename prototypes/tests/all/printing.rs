//! The formatter.

use crate::{COMMON, loaded};
use expect_test::expect;
use rc_diagnostics::SourceMap;
use rc_prototypes::{format, parse};

/// The syntax tree without places.
pub(crate) fn tree(text: &str) -> String {
    let mut sources = SourceMap::new();
    let source = sources.add("a.dproto", text);
    let (file, found) = parse(&sources, source);
    assert!(!found.has_errors(), "{text}");
    let tree = format!("{file:?}");
    let mut parts = tree.split("Span {");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        out.push_str(part.split_once('}').map_or("", |(_, rest)| rest));
    }
    out
}

#[test]
fn a_file_is_formatted() {
    let text = "// of a lidar\nimport   \"Lidar.idsl\"\n\n\n\naxes robocomp::right,ahead,up // right-handed
algebraic named :: Scalar { x,y , z }
ddr point :: ROS {geometry_msgs/Point}
alias position3 <-> named {
  0 = x, 1 = y, // the plane
  2 = z
}
dproto lidar_point :: geometry {
  semantic  = Position
  // where it comes from
  ddr = ::IDSL { RoboCompLidar::Point }  coord = cartesian /* of the sensor */ algebraic = named
  dr = {X=x Y=- y, Z=z}


  frames = { of = point, stamp = member header.stamp }
  usingddr = { mid=\"a \\\" b\", mmid = \"ROS\" }
  // the end
}
conversion a->b=f
load ros-c99
";
    let printed = format(text);
    expect![[r#"
        // of a lidar
        import "Lidar.idsl";

        axes robocomp :: right, ahead, up // right-handed
        algebraic named :: Scalar{x, y, z}
        ddr point :: ROS{geometry_msgs/Point}
        alias position3 <-> named
        {
            0 = x, 1 = y, // the plane
            2 = z
        }
        dproto lidar_point :: geometry
        {
            semantic  = Position
            // where it comes from
            ddr       = :: IDSL{RoboCompLidar::Point}
            coord     = cartesian /* of the sensor */
            algebraic = named
            dr        = { X = x, Y = -y, Z = z }

            frames    = { of = point, stamp = member header.stamp }
            usingddr  = { mid = "a \" b", mmid = "ROS" }
            // the end
        }
        conversion a -> b = f
        load ros-c99
    "#]]
    .assert_eq(&printed);
    assert_eq!(tree(text), tree(&printed));
    assert_eq!(format(&printed), printed);
}

#[test]
fn printing_keeps_meaning_ends_of_lines_and_faulty_texts() {
    let printed = format(COMMON);
    assert_eq!(tree(COMMON), tree(&printed));
    assert_eq!(format(&printed), printed);
    let (_, found) = loaded(&printed);
    assert_eq!(found, "");
    let windows = "axes a :: right,ahead,up\r\nload b\r\n";
    assert_eq!(format(windows), "axes a :: right, ahead, up\r\nload b\r\n");
    let wrong = "dproto  a ::  { ";
    assert_eq!(format(wrong), wrong);
}
