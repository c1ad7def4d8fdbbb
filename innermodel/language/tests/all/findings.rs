//! The findings about a wrong file.

use crate::{Texts, loaded};
use expect_test::{Expect, expect};
use std::path::{Path, PathBuf};

fn check(text: &str, expected: &Expect) {
    expected.assert_eq(&loaded(&Texts::default(), Path::new("world.xml"), text).2);
}

#[test]
fn names_have_suggestions() {
    check(
        r#"<innerModel><transfrom id="a"/><joint id="j" axes="x"/></innerModel>"#,
        &expect![[r#"
            world.xml:1:14: error[unknown-tag]: unknown tag `transfrom` (did you mean `transform`?)
            world.xml:1:46: error[unknown-attribute]: unknown attribute `axes` of `joint` (did you mean `axis`?)
        "#]],
    );
}

#[test]
fn a_repeated_id_shows_both_places() {
    check(
        "<innerModel>\n<transform id='a'>\n  <camera id='a'/>\n</transform>\n<imu id='root'/></innerModel>",
        &expect![[r#"
            world.xml:3:15: error[duplicate-id]: the id `a` is used twice; first used here at world.xml:2:16
            world.xml:5:10: error[duplicate-id]: the id `root` belongs to the node above all others
        "#]],
    );
}

#[test]
fn a_bad_number_is_no_zero() {
    check(
        r#"<innerModel>
            <transform id="a" tx="0,5" ty="@ERROR" tz=""/>
            <joint id="j" min="NaN" max="inf" port="-1"/>
            <plane id="p" size="1,2,3,4" collide="maybe"/>
            <mesh id="m" file="m.obj" scale="1,x"/>
            <translation id="t" tx="inf" mass="1e999"/>
            <joint id="k" min="1" max="0"/>
            <rgbd id="r" noise="-1" width="-640" height="320.5" focal="0"/>
            <sphere id="s"/>
            <cone id="c" radius="0" length="-1"/>
            <laser id="l" rate="-1" dropout="1.5" latency="x"/>
            <human id="h" path="0,0 1;2" speed="-1"/>
            <battery id="b" charging="0" level="2"/>
        </innerModel>"#,
        &expect![[r#"
            world.xml:2:35: error[bad-number]: expected a number for `tx`, found `0,5` (write `0.5`)
            world.xml:2:44: error[bad-number]: expected a number for `ty`, found `@ERROR`
            world.xml:2:56: error[bad-number]: expected a number for `tz`, found ``
            world.xml:3:32: error[bad-number]: expected a number or `inf` for `min`, found `NaN`
            world.xml:3:53: error[bad-number]: expected a whole number for `port`, found `-1`
            world.xml:4:33: error[bad-number]: expected one, two or three numbers separated by commas for `size`, found `1,2,3,4`
            world.xml:4:51: error[bad-number]: expected `0`, `1`, `true` or `false` for `collide`, found `maybe`
            world.xml:5:32: warning[missing-mesh]: cannot find the mesh `m.obj` (it is looked for next to this file, then by its base name along the search path: `-I FOLDER`)
            world.xml:5:46: error[bad-number]: expected one, two or three numbers separated by commas for `scale`, found `1,x`
            world.xml:6:37: error[bad-number]: expected a number for `tx`, found `inf`
            world.xml:6:48: error[bad-number]: expected a number for `mass`, found `1e999`
            world.xml:7:32: error[bad-value]: `min` is greater than `max`
            world.xml:8:33: error[bad-value]: `noise` cannot be negative, found `-1`
            world.xml:8:44: error[bad-value]: `width` must be a whole number from 1, found `-640`
            world.xml:8:58: error[bad-value]: `height` must be a whole number from 1, found `320.5`
            world.xml:8:72: error[bad-value]: `focal` must be greater than 0, found `0`
            world.xml:9:14: error[missing-attribute]: the attribute `radius` is missing
            world.xml:10:34: error[bad-value]: `radius` must be greater than 0, found `0`
            world.xml:10:45: error[bad-value]: `length` must be greater than 0, found `-1`
            world.xml:11:33: error[bad-value]: `rate` cannot be negative, found `-1`
            world.xml:11:46: error[bad-value]: `dropout` must be from 0 to 1, found `1.5`
            world.xml:11:60: error[bad-number]: expected a number for `latency`, found `x`
            world.xml:12:33: error[bad-number]: expected points such as `0,0 1000,500` for `path`, found `0,0 1;2`
            world.xml:12:49: error[bad-value]: `speed` cannot be negative, found `-1`
            world.xml:13:39: error[bad-value]: `charging` must be greater than 0, found `0`
            world.xml:13:49: error[bad-value]: `level` must be from 0 to 1, found `2`
        "#]],
    );
}

#[test]
fn values_are_words_of_a_list() {
    check(
        r#"<innerModel units="metre">
            <joint id="j" axis="w"/>
            <transform id="t" engine="statik"/>
            <mesh id="m" file="a" render="wire"/>
        </innerModel>"#,
        &expect![[r#"
            world.xml:1:20: error[bad-value]: unknown value `metre` of `units` (did you mean `metres`?)
            world.xml:2:33: error[bad-value]: unknown value `w` of `axis` (expected one of `x`, `y`, `z`)
            world.xml:3:39: error[bad-value]: unknown value `statik` of `engine` (did you mean `static`?)
            world.xml:4:32: warning[missing-mesh]: cannot find the mesh `a` (it is looked for next to this file, then by its base name along the search path: `-I FOLDER`)
            world.xml:4:43: error[bad-value]: unknown value `wire` of `render` (expected one of `normal`, `wireframe`)
        "#]],
    );
}

#[test]
fn only_some_elements_have_children() {
    check(
        r#"<innerModel>
            <plane id="p"><transform id="t"/></plane>
            <innerModel/>
        </innerModel>"#,
        &expect![[r#"
            world.xml:2:28: error[misplaced-tag]: `plane` cannot contain `transform`; this element has no children at world.xml:2:14 (put both into one `transform`)
            world.xml:3:14: error[misplaced-tag]: `innerModel` can only be the outermost element (write `<include path="…"/>` to insert another file)
        "#]],
    );
}

#[test]
fn what_has_no_effect_is_a_warning() {
    check(
        r#"<innerModel version="2">
            <transform allowed="nothing"/>-->
            <imu id="imu"/>
        </innerModel>"#,
        &expect![[r#"
            world.xml:1:13: warning[unused-attribute]: the attribute `version` has no effect here
            world.xml:2:14: warning[missing-id]: `transform` has no `id`; it is called `transform#1`
            world.xml:2:33: warning[unknown-id]: no node has the id `nothing`
            world.xml:2:43: warning[stray-text]: the text `-->` has no effect (remove it, or write it as a comment)
        "#]],
    );
}

#[test]
fn a_translation_is_written_once() {
    check(
        r#"<innerModel><transform id="t" tx="1" x="2"/></innerModel>"#,
        &expect![[r#"
            world.xml:1:38: error[repeated-attribute]: `x` sets what another attribute has set already; first set here at world.xml:1:35
        "#]],
    );
}

#[test]
fn other_texts_are_refused() {
    check(
        "",
        &expect![[r#"
        world.xml:1:1: error[empty-file]: expected `<innerModel …> … </innerModel>`, found an empty file
    "#]],
    );
    check(
        "<robot name='a'/>",
        &expect![[r#"
        world.xml:1:2: error[not-an-innermodel]: expected `<innerModel>`, found `<robot>` (this is a URDF: `rcgen import FILE --out FILE.xml` makes an InnerModel file of it)
        world.xml:1:8: warning[unused-attribute]: the attribute `name` has no effect here
    "#]],
    );
    check(
        "<innerModel><transform></innerModel>",
        &expect![[r#"
        world.xml:1:24: error[malformed-xml]: malformed XML: expected `transform` tag, not `innerModel`
    "#]],
    );
    check(
        "<!DOCTYPE a [<!ENTITY b 'c'>]><innerModel/>",
        &expect![[r#"
            world.xml:1:1: error[xml-not-supported]: document types are not supported
        "#]],
    );
}

#[test]
fn nesting_has_an_end() {
    let open = "<transform>".repeat(600);
    let close = "</transform>".repeat(600);
    let text = format!("<innerModel>{open}{close}</innerModel>");
    let (_, found, _) = loaded(&Texts::default(), Path::new("world.xml"), &text);
    assert!(found.iter().any(|d| d.code == "nested-too-deep"));
}

#[test]
fn includes_are_found_or_reported() {
    let mut files = Texts::of(&[
        (
            "world/a.xml",
            r#"<innerModel><include path="b.xml"/></innerModel>"#,
        ),
        (
            "world/b.xml",
            r#"<innerModel><include path="./a.xml"/></innerModel>"#,
        ),
        (
            "library/table.xml",
            r#"<innerModel><transform id="table"/></innerModel>"#,
        ),
        ("library/cup.obj", ""),
    ]);
    files.search.push(PathBuf::from("library"));
    let text = r#"<innerModel>
        <include path="a.xml"/>
        <include path="/home/robot/models/table.xml"/>
        <include path="chair.xml"/>
        <include/>
        <mesh id="cup" file="/home/robot/cup.obj"/>
        <mesh id="plate" file="plate.obj"/>
        <mesh id="spoon"/>
    </innerModel>"#;
    let (document, _, output) = loaded(&files, Path::new("world/main.xml"), text);
    expect![[r#"
        world/main.xml:3:24: note[file-elsewhere]: `/home/robot/models/table.xml` was found as `library/table.xml`
        world/main.xml:4:24: error[include-not-found]: cannot find the included file `chair.xml` (a file is looked for next to this one, then by its base name along the search path: `-I FOLDER`)
        world/main.xml:5:10: error[missing-attribute]: the attribute `path` is missing
        world/main.xml:6:30: note[file-elsewhere]: `/home/robot/cup.obj` was found as `library/cup.obj`
        world/main.xml:7:32: warning[missing-mesh]: cannot find the mesh `plate.obj` (it is looked for next to this file, then by its base name along the search path: `-I FOLDER`)
        world/main.xml:8:10: warning[missing-mesh]: the attribute `file` is missing
        world/b.xml:1:28: error[include-cycle]: files include each other: world/a.xml → world/b.xml
    "#]].assert_eq(&output);
    let ids: Vec<&str> = document.nodes.iter().map(|node| node.id.as_str()).collect();
    assert_eq!(ids, ["table", "cup", "plate", "spoon"]);
}

#[test]
fn files_that_include_twice_as_many_end() {
    // Each file includes the next one twice.
    let names: Vec<(String, String)> = (0..40)
        .map(|n| {
            let next = format!(r#"<include path="{}.xml"/>"#, n + 1);
            (
                format!("{n}.xml"),
                format!("<innerModel>{next}{next}</innerModel>"),
            )
        })
        .chain([("40.xml".to_owned(), "<innerModel/>".to_owned())])
        .collect();
    let pairs: Vec<(&str, &str)> = names
        .iter()
        .map(|(a, b)| (a.as_str(), b.as_str()))
        .collect();
    let files = Texts::of(&pairs);
    let text = r#"<innerModel><include path="0.xml"/></innerModel>"#;
    let (_, found, _) = loaded(&files, Path::new("main.xml"), text);
    assert!(found.iter().any(|d| d.code == "too-many-includes"));
}

/// A number of metres may be too great in millimetres.
#[test]
fn a_length_is_finite_in_millimetres() {
    check(
        r#"<innerModel units="metres">
            <transform id="t" tx="1e306" ty="1e305" rx="1e306"/>
            <plane id="p" size="1,1e306"/>
            <mesh id="m" file="" scale="-1e306"/>
            <prismaticJoint id="j" min="-1e306" max="inf" offset="1e307"/>
            <sphere id="s" radius="1e306"/>
            <human id="h" path="0,0 1e306,0" speed="1e306"/>
        </innerModel>"#,
        &expect![[r#"
            world.xml:2:35: error[bad-number]: expected a finite length for `tx`, found `1e306`
            world.xml:3:33: error[bad-number]: expected finite lengths for `size`, found `1,1e306`
            world.xml:4:32: warning[missing-mesh]: cannot find the mesh `` (it is looked for next to this file, then by its base name along the search path: `-I FOLDER`)
            world.xml:4:41: error[bad-number]: expected finite lengths for `scale`, found `-1e306`
            world.xml:5:41: error[bad-number]: expected a number or `inf` for `min`, found `-1e306`
            world.xml:5:67: error[bad-number]: expected a finite length for `offset`, found `1e307`
            world.xml:6:36: error[bad-number]: expected a finite length for `radius`, found `1e306`
            world.xml:7:33: error[bad-number]: expected points such as `0,0 1000,500` for `path`, found `0,0 1e306,0`
            world.xml:7:53: error[bad-number]: expected a finite length for `speed`, found `1e306`
        "#]],
    );
}

/// Each of many files includes the next one.
#[test]
fn a_long_chain_of_files_ends() {
    let names: Vec<(String, String)> = (0..2000)
        .map(|n| {
            let next = format!(
                r#"<innerModel><include path="{}.xml"/></innerModel>"#,
                n + 1
            );
            (format!("{n}.xml"), next)
        })
        .collect();
    let pairs: Vec<(&str, &str)> = names
        .iter()
        .map(|(a, b)| (a.as_str(), b.as_str()))
        .collect();
    let text = r#"<innerModel><include path="0.xml"/></innerModel>"#;
    let (_, _, output) = loaded(&Texts::of(&pairs), Path::new("main.xml"), text);
    let expected =
        "63.xml:1:28: error[nested-too-deep]: files include each other more than 64 deep\n";
    assert_eq!(output, expected);
}

/// 10,000 levels are refused, closed or not, also where a text is only laid out.
#[test]
fn deep_nesting_is_refused() {
    for tag in ["transform", "unknown", "plane"] {
        let open = format!("<{tag} id='a'>").repeat(10_000);
        let close = format!("</{tag}>").repeat(10_000);
        for text in [
            format!("<innerModel>{open}{close}</innerModel>"),
            format!("<innerModel>{open}"),
        ] {
            let mut sources = rc_diagnostics::SourceMap::new();
            let source = sources.add("world.xml", text.as_str());
            assert!(innermodel_language::parse(&sources, source).has_errors());
            let (_, found, _) = loaded(&Texts::default(), Path::new("world.xml"), &text);
            assert!(found.has_errors(), "{tag}");
        }
    }
    // At the greatest depth.
    let open: String = (0..512).map(|n| format!("<transform id='t{n}'>")).collect();
    let text = format!(
        "<innerModel>{open}{}</innerModel>",
        "</transform>".repeat(512)
    );
    let document = crate::right(&text);
    let formatted = innermodel_language::format(&text);
    assert_eq!(crate::right(&formatted), document);
    assert_eq!(
        crate::right(&innermodel_language::print(&document)),
        document
    );
}
