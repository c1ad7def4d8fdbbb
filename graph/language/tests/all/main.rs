//! Tests of GDSL: what a domain becomes, and what is wrong with one.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use graph_language::model::{Kind, PoseOf, Schema};
use graph_language::{DOMAINS, STYLE, builtin, load};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use std::fmt::Write as _;

/// Two representations of a position, another meaning, and points.
const PLACES: &str = r#"
algebraic xyz :: Scalar{x, y, z}
algebraic polar :: Scalar{distance, angle}
units mm :: qudt, xyz { x = mm, y = mm, z = mm }
axes body :: ahead, left, up
dproto place :: geometry { semantic = Position coord = cartesian algebraic = xyz ddr = :: c99{double[3]} dr = { 0 = x, 1 = y, 2 = z } axes = body }
dproto raw :: geometry { semantic = Position coord = cartesian algebraic = xyz ddr = :: c99{double[3]} dr = { 0 = x, 1 = y, 2 = z } units = mm axes = body }
dproto flat :: geometry { semantic = Position coord = polar algebraic = polar ddr = :: c99{double[2]} dr = { 0 = distance, 1 = angle } axes = body }
dproto speed :: geometry { semantic = LinearVelocity coord = cartesian algebraic = xyz ddr = :: c99{double[3]} dr = { 0 = x, 1 = y, 2 = z } axes = body }
dproto outline :: geometry { semantic = PointSet coord = cartesian algebraic = xyz ddr = :: c99{double[3]} dr = { 0 = x, 1 = y, 2 = z } sequence = member points }
"#;

fn loaded(text: &str) -> (Option<Schema>, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("a.gdsl", text);
    let loader = MemoryLoader::new([
        (
            "rooms.gdsl",
            "Domain rooms { entity Room { name string key; }; };",
        ),
        ("places.dproto", PLACES),
        (
            "broken.dproto",
            "dproto p :: geometry { semantic = Positon }",
        ),
    ]);
    let (schema, found) = load(&mut sources, &loader, source);
    (schema, render(&sources, &found, Format::Short))
}

fn schema(text: &str) -> Schema {
    let (schema, found) = loaded(text);
    assert_eq!(found, "");
    schema.expect("a schema")
}

/// A domain with these declarations, and its findings.
fn check(items: &str, expected: &Expect) {
    let (_, found) = loaded(&format!("Domain a\n{{\n{items}\n}};\n"));
    expected.assert_eq(&found);
}

#[test]
fn a_domain_becomes_a_schema() {
    let schema = schema(
        r#"import "geometry.gdsl";
import "rooms.gdsl";
Domain kitchen
{
    /// Something to handle.
    entity Object { name string key; mass double unit "kg" 0: optional; colour {red, green} optional; };
    entity Hose : Object { length float unit "mm" history 2s; };
    entity Gripper { payload float unit "kg"; };
    relation in { what Object; where Room 0:20;  tree; };
    relation Grasp { by Gripper; what Object :1; since float; };
    require Object.mass <= Gripper.payload of Grasp "heavier than the payload";
    query people_in(room Room) "MATCH (p:Person)-[:in]->(r) WHERE r = $room RETURN p";
};
"#,
    );
    assert_eq!((schema.name.as_str(), schema.open), ("kitchen", false));
    let hose = schema.entity("Hose").expect("a hose");
    let names: Vec<&str> = hose.attributes.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["name", "mass", "colour", "length"]);
    assert!(schema.is_a("Hose", "Object") && !schema.is_a("Object", "Hose"));
    let object = schema.entity("Object").expect("an object");
    assert_eq!(object.doc, ["Something to handle."]);
    let mass = object.attribute("mass").expect("a mass");
    assert_eq!(mass.range, Some((0.0, f64::INFINITY)));
    assert_eq!((mass.unit.as_deref(), mass.optional), (Some("kg"), true));
    let is_in = schema.relation("in").expect("a relation");
    assert_eq!(is_in.tree.as_ref().map(|tree| tree.child), Some(0));
    assert_eq!((is_in.ports[1].min, is_in.ports[1].max), (0, Some(20)));
    let rt = schema.relation("RT").expect("a relation");
    let tree = rt.tree.as_ref().expect("a tree");
    assert_eq!(tree.child, 1);
    assert_eq!(tree.pose, Some(PoseOf::One("pose".to_owned())));
    assert_eq!(rt.attributes[0].kind, Kind::Floats(Some(6)));
    assert_eq!((schema.rules[0].left.0, schema.rules[0].right.0), (1, 0));
    assert_eq!(schema.queries[0].name, "people_in");
}

#[test]
fn domains_of_this_crate_are_right() {
    for (name, text) in DOMAINS {
        let (_, found) = loaded(text);
        assert_eq!(found, "", "{name}");
        assert!(builtin(name).is_some());
        let formatted = rc_syntax::format(text, STYLE);
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            let path = concat!(env!("CARGO_MANIFEST_DIR"), "/domains");
            std::fs::write(format!("{path}/{name}"), formatted).expect("a file");
        } else {
            assert_eq!(formatted, text, "{name} is not formatted");
        }
    }
    let dsr = builtin("dsr.gdsl").expect("a schema");
    assert!(dsr.open);
}

#[test]
fn keys_of_relations_and_second_trees_are_findings() {
    check(
        "entity A { }; relation r { what A; other A; number int key; tree; tree of other; };",
        &expect![[r#"
            a.gdsl:3:56: error[key-of-relation]: `number` belongs to a relation, and only entities have keys (remove `key`, or make an entity of the relation)
            a.gdsl:3:67: error[second-tree]: `r` is a tree already; first given here at a.gdsl:3:61 (remove one, or declare a second relation)
        "#]],
    );
}

#[test]
fn wrong_entities_are_findings() {
    check(
        "entity A { x int; x float; y strin; }; entity A { }; entity int { }; entity B : C { };",
        &expect![[r#"
            a.gdsl:3:19: error[duplicate-member]: `x` is declared twice; first declared here at a.gdsl:3:12
            a.gdsl:3:30: error[unknown-type]: unknown type `strin` (did you mean `string`?)
            a.gdsl:3:47: error[duplicate-name]: `A` is declared twice; first declared here at a.gdsl:3:8
            a.gdsl:3:61: error[reserved-name]: `int` is the name of a built-in type
            a.gdsl:3:81: error[unknown-entity]: unknown entity `C` (expected one of `A`, `B`)
        "#]],
    );
    check(
        "entity A : B { }; entity B : A { x int; }; entity C : B { x float; };",
        &expect![[r#"
            a.gdsl:3:30: error[circular-entities]: `B` inherits from itself
            a.gdsl:3:59: error[duplicate-member]: `C` inherits an attribute `x`
        "#]],
    );
    check(
        r#"entity A { a string unit "m"; b int 5:1; c float key; d int unit "mm" unit "m"; e float[0]; f bool[]; g float unit "metre per banana"; };"#,
        &expect![[r#"
            a.gdsl:3:21: error[wrong-type]: `a` of type string cannot have a unit
            a.gdsl:3:37: error[bad-range]: the range 5:1 is empty
            a.gdsl:3:50: error[wrong-type]: `c` of type float cannot have the property `key`
            a.gdsl:3:71: error[repeated-flag]: `d` has this property already; first given here at a.gdsl:3:61
            a.gdsl:3:89: error[bad-length]: expected a length from 1 to 8192, found the number 0
            a.gdsl:3:95: error[wrong-type]: there are no arrays of `bool` like this one (use `int[]`, `int[N]`, `float[]`, `float[N]` or `string[]`)
            a.gdsl:3:116: warning[unknown-unit]: unknown unit `per` in `metre per banana`
        "#]],
    );
}

#[test]
fn a_rule_over_two_ports_of_one_entity_names_a_port() {
    let text = |left: &str, right: &str| {
        format!(
            "Domain d {{ entity Object {{ mass float; limit float; }};
            relation on {{ top Object; below Object; }};
            require {left}.mass <= {right}.limit of on \"too heavy\"; }};"
        )
    };
    let (_, found) = loaded(&text("Object", "below"));
    let expected = "error[unknown-port]: both ports of `on` are for `Object`; name one of them";
    assert!(found.contains(expected), "{found}");
    let schema = schema(&text("top", "below"));
    assert_eq!((schema.rules[0].left.0, schema.rules[0].right.0), (0, 1));
}

/// Time and memory of inheritance are bounded.
#[test]
fn a_long_chain_of_entities_is_refused() {
    let chain: String = (1..2000)
        .map(|at| format!("entity A{at} : A{} {{ a{at} int; }};\n", at - 1))
        .collect();
    let (_, found) = loaded(&format!("Domain d {{ entity A0 {{ }};\n{chain}}};"));
    assert!(
        found.contains("error[nested-too-deep]: `A65` has more than 64 ancestors"),
        "{found}"
    );
    assert!(!found.contains("`A64` has"), "{found}");
}

#[test]
fn limits_and_histories_fit_their_type() {
    check(
        "entity A { a int 0:18446744073709551616; b int 0:1.5; c int -9223372036854775808:0x7fffffffffffffff;\n\
         d float 0:1e300; e int[2] :1e400; f float history -1s; g float history 0s; h float history 1e30s;\n\
         i float history 2s; j float history 5; };",
        &expect![[r#"
            a.gdsl:3:20: error[bad-range]: expected an integer of 64 bits, found the number 18446744073709551616
            a.gdsl:3:50: error[bad-range]: expected an integer of 64 bits, found the number 1.5
            a.gdsl:4:28: error[bad-range]: expected an integer of 64 bits, found a number that is too large
            a.gdsl:4:51: error[bad-time]: expected a time above 0 such as `2s`
            a.gdsl:4:72: error[bad-time]: expected a time above 0 such as `2s`
            a.gdsl:5:37: error[syntax-error]: expected a duration, found `5`
        "#]],
    );
}

#[test]
fn wrong_relations_are_findings() {
    check(
        "entity A { x int; s string; };
relation one { a A; };
relation three { a A; b A; c A; };
relation far { a A; b Bb; };
relation wood { a A; b A; tree of c; };
relation RT { a A; b A; tree interpolated; };
relation two { a A; b A; t float[3]; r float[2]; tree interpolated(t, r); };
relation good { a A; b A; };
require a.x <= b.s of good \"no\";
require a.y <= c.x of good \"no\";
require a.x <= b.x of goof \"no\";
query q(a Aa) \"MATCH (a) RETURN a\";",
        &expect![[r#"
            a.gdsl:4:10: error[wrong-ports]: expected two ports in `one`, found 1 (write `PORT ENTITY;` for each end)
            a.gdsl:5:10: error[wrong-ports]: expected two ports in `three`, found 3 (make an entity of it, with a relation for each port)
            a.gdsl:6:23: error[unknown-entity]: unknown entity `Bb` (expected `A`)
            a.gdsl:7:35: error[unknown-port]: `wood` has no port `c` (expected one of `a`, `b`)
            a.gdsl:8:25: error[wrong-tree]: `RT` has no attribute of type `pose` (add `pose pose;`, or name two attributes: `interpolated(by, angles)`)
            a.gdsl:9:71: error[wrong-tree]: `r` is float[2], expected float[3]
            a.gdsl:11:18: error[wrong-type]: `s` is string, no number
            a.gdsl:12:11: error[unknown-attribute]: `A` has no attribute `y` (expected one of `x`, `s`)
            a.gdsl:12:16: error[unknown-port]: `good` has no port `c` (expected one of `A`, `a`, `b`)
            a.gdsl:13:23: error[unknown-relation]: unknown relation `goof` (did you mean `good`?)
            a.gdsl:14:11: error[unknown-entity]: unknown entity `Aa` (did you mean `A`?)
        "#]],
    );
}

#[test]
fn syntax_errors_are_findings() {
    check(
        "entity A { x int\ny float; };\nentty B { };\nentity { };",
        &expect![[r#"
            a.gdsl:3:17: error[missing-semicolon]: expected `;`
            a.gdsl:5:1: error[unknown-declaration]: expected a declaration of a domain, found `entty` (did you mean `entity`?)
            a.gdsl:6:8: error[syntax-error]: expected a name, found `{`
        "#]],
    );
    let (schema, found) = loaded("import \"nothing.gdsl\";\nDomain a { };");
    assert!(schema.is_some());
    expect![[r#"
        a.gdsl:1:8: error[import-not-found]: cannot find `nothing.gdsl`; searched in memory (copy the file into one of these folders, or pass its folder with `-I DIR`)
    "#]].assert_eq(&found);
    let (schema, found) = loaded("");
    assert!(schema.is_none());
    expect![[r#"
        a.gdsl:1:1: error[empty-file]: expected `Domain NAME { … };`, found an empty file
    "#]]
    .assert_eq(&found);
}

#[test]
fn a_file_is_formatted() {
    let text = "Domain a{entity A{x int 0:5 unit \"m\";y {red,green};};relation r{a A;b A 0 :1;tree of a;};};";
    let expected = expect![[r#"
        Domain a
        {
            entity A
            {
                x int 0:5 unit "m";
                y { red, green };
            };
            relation r
            {
                a A;
                b A 0:1;
                tree of a;
            };
        };
    "#]];
    expected.assert_eq(&rc_syntax::format(text, STYLE));
    let once = rc_syntax::format(text, STYLE);
    assert_eq!(rc_syntax::format(&once, STYLE), once);
}

#[test]
fn a_relation_is_an_entity_to_others() {
    let schema = schema(
        r#"Domain a
{
    entity Frame { };
    entity Relation { since float optional; };
    entity Pose : Relation { };
    relation is_at { what Frame; where Frame; exact bool; promotes Pose; };
    relation said_by { what Relation; by Frame; };
};
"#,
    );
    let is_at = schema.relation("is_at").expect("a relation");
    assert_eq!(is_at.promotes.as_deref(), Some("Pose"));
    let names: Vec<&str> = is_at.attributes.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["since", "exact"]);
    assert!(schema.is_a("is_at", "Relation") && !schema.is_a("said_by", "Relation"));
    check(
        r#"
entity A { };
entity K { name string key; };
entity E { since float; };
relation r { a A; b A; promotes Aa; };
relation s { a A; b A; promotes K; };
relation t { a A; b A; promotes A; promotes E; };
relation u { a A; b A; since int; promotes E; };
"#,
        &expect![[r#"
            a.gdsl:7:33: error[unknown-entity]: unknown entity `Aa` (did you mean `A`?)
            a.gdsl:8:33: error[key-of-relation]: `K` has the key `name`, and only nodes have keys (name an entity without a key)
            a.gdsl:9:45: error[repeated-flag]: `t` has this property already; first given here at a.gdsl:9:33
            a.gdsl:10:24: error[duplicate-member]: `u` inherits an attribute `since`
        "#]],
    );
}

#[test]
fn composites_name_their_parts() {
    let whole = r#"
entity R { };
entity A : R { };
entity B : R { composed_by A; };
"#;
    let relation = "relation composed_by { whole R; part R; };\n";
    let (schema, found) = loaded(&format!("Domain a {{ {whole}{relation} }};"));
    assert_eq!(found, "");
    let schema = schema.expect("a schema");
    assert_eq!(schema.entity("B").expect("a composite").parts, ["A"]);
    check(
        whole,
        &expect![[r#"
        a.gdsl:6:28: error[unknown-relation]: there is no relation `composed_by` from a whole to a part (import "geometry.gdsl", or declare it with a port for each of them)
    "#]],
    );
    check(
        &format!(
            "{relation}{}",
            r#"
entity R { };
entity Other { };
entity A : R { composed_by B, Aa; };
entity B : R { composed_by A, Other; };
entity C : R { composed_by A, A; };
entity D : R { composed_by E; };
entity E : D { };
"#
        ),
        &expect![[r#"
            a.gdsl:7:31: error[unknown-entity]: unknown entity `Aa` (did you mean `A`?)
            a.gdsl:8:28: error[circular-entities]: `B` is composed by itself
            a.gdsl:8:31: error[wrong-port]: port `part` of `composed_by` is for R, found Other
            a.gdsl:9:31: error[duplicate-member]: `A` occurs twice
            a.gdsl:10:28: error[circular-entities]: `D` is composed by itself
        "#]],
    );
}

#[test]
fn attributes_have_data_prototypes() {
    let schema = schema(
        "import \"places.dproto\";
Domain a
{
    entity Thing
    {
        where dproto place history 2s;
        raw dproto raw consistency where;
        outline dproto outline optional;
    };
    entity Cup : Thing
    {
        other dproto raw consistency where;
        picture topic optional;
    };
    relation seen { what Thing; by Thing; at dproto place; at_raw dproto raw consistency at; };
};
",
    );
    let block = |kind: &str, name: &str| {
        let entity = schema.entity(kind).map(|entity| &entity.attributes);
        let all = entity.or_else(|| schema.relation(kind).map(|r| &r.attributes));
        let attribute = all.into_iter().flatten().find(|a| a.name == name);
        let Some(Kind::Block(block)) = attribute.map(|a| &a.kind) else {
            panic!("{kind}.{name} is {attribute:?}");
        };
        std::sync::Arc::clone(block)
    };
    let place = block("Thing", "where");
    assert_eq!(place.meaning, "Position (cartesian, m, ahead-left-up)");
    assert_eq!(
        place.converted(&[1.0, 2.0, 3.0], "raw"),
        Some(vec![1000.0, 2000.0, 3000.0])
    );
    assert_eq!(place.converted(&[1.0, 2.0, 3.0], "outline"), None);
    let ways = |kind: &str, name: &str| -> Vec<String> {
        let block = block(kind, name);
        block.conversions.iter().map(|way| way.to.clone()).collect()
    };
    assert_eq!(ways("Thing", "where"), ["raw"]);
    // An inherited value has one representation more.
    assert_eq!(ways("Cup", "where"), ["raw", "other"]);
    assert_eq!(ways("Cup", "raw"), ["where", "other"]);
    assert_eq!(ways("seen", "at_raw"), ["at"]);
    let outline = block("Thing", "outline");
    assert!(outline.is_sequence && outline.refusal(&[0.0; 9]).is_none());
    assert_eq!(
        outline.refusal(&[0.0; 8]).as_deref(),
        Some("8 numbers, not 3 numbers for each value")
    );
    // A requirement of the schema holds once.
    let thing = schema.entity("Thing").expect("an entity");
    let optional: Vec<bool> = thing.attributes.iter().map(|a| a.optional).collect();
    assert_eq!(optional, [false, true, true]);
}

/// Attributes of which as many as `size` have one value each.
fn attributes(count: usize, size: usize) -> String {
    let mut text = "import \"places.dproto\";\nDomain a { entity Thing {\n".to_owned();
    for at in 0..count {
        let head = at - at % size;
        let _ = match at - head {
            0 => writeln!(text, "a{at} dproto place;"),
            _ => writeln!(text, "a{at} dproto raw consistency a{head};"),
        };
    }
    text + "}; };"
}

#[test]
fn many_attributes_take_as_long_as_they_are_many() {
    assert_eq!(loaded(&attributes(64, 8)).1, "");
    let (_, found) = loaded(&attributes(9, 9));
    assert_eq!(
        found.lines().next(),
        Some("a.gdsl:4:27: error[wrong-consistency]: more than 8 attributes have this value")
    );
    let time = |count: usize, size: usize| {
        let text = attributes(count, size);
        let started = std::time::Instant::now();
        let _ = loaded(&text);
        started.elapsed()
    };
    for size in [8, usize::MAX] {
        let (few, many) = (time(1250, size), time(10_000, size));
        assert!(
            many < few * 30 + std::time::Duration::from_millis(200),
            "in groups of {size}: 1,250 attributes {few:?}, 10,000 {many:?}"
        );
    }
}

#[test]
fn names_like_words_in_other_letters_are_types() {
    let schema = schema(
        "Domain a { entity Topic { }; entity Dproto { }; relation on { from Topic 0:1; to Dproto; }; };",
    );
    let ports = &schema.relation("on").expect("a relation").ports;
    let ports: Vec<&str> = ports.iter().map(|port| port.entity.as_str()).collect();
    assert_eq!(ports, ["Topic", "Dproto"]);
    check(
        "entity Thing { picture Topic; };",
        &expect![[r#"
        a.gdsl:3:24: error[unknown-type]: unknown type `Topic` (expected one of `bool`, `int`, `long`, `float`, `double`, `string`, `bytes`, `pose`)
    "#]],
    );
}

#[test]
fn wrong_data_prototypes_are_findings() {
    let (_, found) = loaded(
        "import \"places.dproto\";
Domain a
{
    entity Thing
    {
        where dproto plce;
        a dproto place unit \"m\" 0:1;
        b dproto raw consistency a key;
        c dproto raw consistency b;
        d dproto raw consistency d;
        e dproto raw consistency nothing;
        f float consistency a;
        g dproto raw consistency f;
        h dproto speed consistency a;
        i dproto flat consistency a;
        j dproto outline consistency a;
        k dproto raw consistency a optional;
        l topic \"T\" unit \"m\";
    };
};
",
    );
    expect![[r#"
        a.gdsl:6:22: error[unknown-prototype]: unknown prototype `plce` (did you mean `place`?)
        a.gdsl:7:24: error[wrong-type]: `a` has what its prototype says (change the `.dproto`)
        a.gdsl:7:33: error[wrong-type]: `a` has what its prototype says (change the `.dproto`)
        a.gdsl:8:36: error[wrong-type]: `b` of type dproto raw cannot have the property `key`
        a.gdsl:9:34: error[wrong-consistency]: `b` is itself the value of `a` (write `consistency a`)
        a.gdsl:10:34: error[wrong-consistency]: `d` is consistent with itself
        a.gdsl:11:34: error[unknown-attribute]: `Thing` has no attribute `nothing` (expected one of `where`, `a`, `b`, `c`, `d`, `e`, `f`, `g`, `h`, `i`, `j`, `k`, `l`)
        a.gdsl:12:17: error[wrong-type]: `f` of type float cannot have the property `consistency`
        a.gdsl:13:34: error[wrong-consistency]: `f` has no data prototype (`consistency` connects attributes of type `dproto`)
        a.gdsl:14:36: error[semantic-mismatch]: `place` does not convert into `speed`: the meanings differ: Position and LinearVelocity
        a.gdsl:15:35: error[conversion-loses]: `place` does not convert into `flat`: z is not kept, not bounded
        a.gdsl:16:38: error[no-conversion]: `place` does not convert into `outline`: one holds a sequence of values, the other one a value
        a.gdsl:17:36: error[wrong-type]: `k` has the properties of another attribute (give `a` this property)
        a.gdsl:18:21: error[wrong-type]: `l` of type topic "T" cannot have a unit
    "#]].assert_eq(&found);
    let (_, found) = loaded("Domain a { entity T { p dproto place; }; };");
    expect![[r#"
        a.gdsl:1:32: error[unknown-prototype]: unknown prototype `place` (import a `.dproto` file that declares it)
    "#]].assert_eq(&found);
    // An error in a file of prototypes is reported once.
    let (_, found) = loaded("import \"broken.dproto\"; Domain a { entity T { p dproto p; }; };");
    expect![[r#"
        broken.dproto:1:35: error[unknown-semantic]: `geometry` has no meaning `Positon` (did you mean `Position`?)
    "#]].assert_eq(&found);
}

#[test]
fn units_of_what_belongs_together_are_compared() {
    check(
        r#"entity Object { mass float unit "g"; size float unit "m"; count int; };
entity Gripper { payload float unit "kg"; };
relation grasp { by Gripper; what Object; };
require Object.mass <= Gripper.payload of grasp "heavier than the payload";
require Object.size <= Gripper.payload of grasp "no";
require Object.count <= Gripper.payload of grasp "nobody says the unit";
relation at { child Object; parent Object; by float[3] unit "m"; angles float[3] unit "deg"; tree interpolated(by, angles); };
relation again { child Object; parent Object; pose pose unit "mm"; };
relation same { child Object; parent Object; pose pose unit "m"; };"#,
        &expect![[r#"
            a.gdsl:6:32: error[unit-mismatch]: `mass` is in `g`, but `payload` is in `kg` (1 kg is 1000 g)
            a.gdsl:7:32: error[unit-mismatch]: `size` is in `m`, but `payload` is in `kg` (`kg` and `m` measure different things)
            a.gdsl:9:66: error[unit-mismatch]: the angles `angles` are in `deg`, expected `rad` (a transform takes radians)
            a.gdsl:10:47: error[unit-mismatch]: `pose` is in `mm`, but the poses of `at` are in `m` (1 mm is 0.001 m)
        "#]],
    );
}
