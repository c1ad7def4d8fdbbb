//! `rcgen` with data prototypes.

use crate::folders::rcgen;
use crate::rcgen::succeeds;
use expect_test::expect;

const POINTS: &str = "\
import \"Lidar.idsl\";
algebraic named :: Scalar{x, y, z}
axes robocomp :: right, ahead, up
dproto point :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = named
    ddr       = :: IDSL{Lidar::Point}
    dr        = { X = x, Y = y, Z = z }
    axes      = robocomp
}
";

const LIDAR: &str = "\
module Lidar
{
    struct Point { @unit(\"mm\") float X; @unit(\"mm\") float Y; @unit(\"mm\") float Z; };
};
";

#[test]
fn prototypes_are_checked_formatted_and_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).expect("a file");
    write("Lidar.idsl", LIDAR);
    write("points.dproto", POINTS);
    assert_eq!(succeeds(path, &["check", "points.dproto", "."]), "");

    let view = succeeds(path, &["view", "points.dproto"]);
    let view: serde_json::Value = serde_json::from_str(&view).expect("JSON");
    expect![[r#"
        {
          "axes": "robocomp",
          "content": {
            "values": {
              "algebraic": "named",
              "coordinate": "cartesian",
              "data": [
                {
                  "member": "X",
                  "symbol": "x",
                  "unit": "mm"
                },
                {
                  "member": "Y",
                  "symbol": "y",
                  "unit": "mm"
                },
                {
                  "member": "Z",
                  "symbol": "z",
                  "unit": "mm"
                }
              ],
              "language": "IDSL",
              "ty": "Lidar::Point"
            }
          },
          "covariance": null,
          "domain": "geometry",
          "frames": [],
          "loss": null,
          "name": "point",
          "semantic": "Position",
          "sequence": null,
          "tolerance": null
        }"#]]
    .assert_eq(&serde_json::to_string_pretty(&view["prototypes"][0]).expect("JSON"));

    write(
        "points.dproto",
        &POINTS.replace("= cartesian", "=   cartesian"),
    );
    let (code, out, _) = rcgen(path, &["fmt", "--check", "points.dproto"]);
    assert_eq!((code, out.as_str()), (1, "not formatted: points.dproto\n"));
    succeeds(path, &["fmt", "points.dproto"]);
    let printed = std::fs::read_to_string(path.join("points.dproto"));
    assert_eq!(printed.expect("the file"), POINTS);

    write("points.dproto", &POINTS.replace("cartesian", "cartesien"));
    for command in ["check", "view"] {
        let (code, _, err) = rcgen(path, &[command, "points.dproto", "--format", "short"]);
        let expected = "points.dproto:7:17: error[unknown-coordinate]: Position has no coordinates `cartesien` (did you mean `cartesian`?)\n";
        assert_eq!((code, err.as_str()), (1, expected), "{command}");
    }
    let (code, _, err) = rcgen(path, &["view", "missing.dproto"]);
    assert_eq!(code, 3);
    assert!(err.contains("missing.dproto: No such file"), "{err}");
    assert!(succeeds(path, &["explain", "unknown-coordinate"]).contains("coordinates"));
    let list = succeeds(path, &["convert", "--list"]);
    assert!(list.starts_with("geometry\n    Position "), "{list}");
    assert!(list.contains("    quaternion_wxyz "), "{list}");
}
