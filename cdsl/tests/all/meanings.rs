//! Prototypes that a component imports, and that its interfaces name.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

/// Checks the findings for a component with these declarations of its interface and prototypes.
fn check(idsl: &str, dproto: &str, expected: &Expect) {
    let idsl = format!("module L {{ {idsl} interface Laser {{ void push(P p); }}; }};");
    let loader = MemoryLoader::new([("Laser.idsl", idsl.as_str()), ("Laser.dproto", dproto)]);
    let mut sources = SourceMap::new();
    let text = "import \"Laser.idsl\"; import \"Laser.dproto\";\n\
        Component lidar { Communications { publishes Laser; }; language rust; };";
    let source = sources.add("lidar.cdsl", text.to_owned());
    let (component, mut found) = rc_cdsl::load(&mut sources, &loader, source);
    let mut component = component.expect("a component");
    found.extend(rc_cdsl::meanings(
        &mut component,
        &mut sources,
        &loader,
        source,
    ));
    expected.assert_eq(&render(&sources, &found, Format::Short));
    let is_read = !component.prototypes.prototypes.is_empty();
    assert_eq!(is_read, !found.has_errors());
}

const POINT: &str = "import \"Laser.idsl\"; algebraic named :: Scalar{x, y}
    dproto point :: geometry { semantic = Position coord = cartesian algebraic = named
        ddr = :: IDSL{L::P} dr = { x = x, y = y } }";

#[test]
fn names_of_prototypes_are_checked() {
    let plain = "struct P { float x; float y; }; sequence<P> Ps;";
    check(plain, POINT, &expect![[""]]);
    let chosen = "@dproto(\"point\") struct P { float x; float y; }; struct S { @dproto(\"point\") sequence<P> ps; };";
    check(chosen, POINT, &expect![[""]]);
    let wrong = "@dproto(\"pont\") struct P { float x; float y; }; struct S { @dproto(\"point\") float f; };
        @dproto(\"point\") struct Q { float x; };";
    check(
        wrong,
        POINT,
        &expect![[r#"
        Laser.idsl:1:20: error[unknown-prototype]: unknown prototype `pont` (did you mean `point`?)
        Laser.idsl:1:79: error[wrong-type]: `point` is not a prototype of the type of `f` (`@dproto` belongs to a structure, or to a sequence or an array of them)
        Laser.idsl:2:17: error[wrong-type]: `point` is not a prototype of the type of `Q` (name one with `ddr = :: IDSL{L::Q}`)
    "#]],
    );
    check(
        plain,
        "dproto point :: geometry { }",
        &expect![[r#"
        Laser.dproto:1:8: error[missing-field]: `point` has no field `semantic` (add `semantic = …`)
    "#]],
    );
    check(
        "@dproto(3) struct P { @dproto float x; float y; };",
        POINT,
        &expect![[r#"
            Laser.idsl:1:13: error[annotation-arguments]: `@dproto` takes one string, and stands once: `@dproto("point")`
            Laser.idsl:1:35: error[annotation-arguments]: `@dproto` takes one string: `@dproto("point")`
        "#]],
    );
}
