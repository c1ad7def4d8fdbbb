//! Diagnostics for `.idsl` texts: common mistakes, each with its location, and RoboComp's habits,
//! which the parser accepts.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_diagnostics::{Format, SourceMap, render};
use rc_idsl::{Library, Session};
use rc_syntax::MemoryLoader;

/// Files that the tests import.
const OTHERS: [(&str, &str); 5] = [
    (
        "Base.idsl",
        "module Base { struct State { int x; }; exception Broken { string what; }; };",
    ),
    ("Other.idsl", "module Other { struct State { int y; }; };"),
    ("Deep.idsl", "import \"Base.idsl\"; module Deep { };"),
    (
        "Ring.idsl",
        "import \"m.idsl\";\nmodule Ring { struct Link { int x; }; };",
    ),
    ("Twin.idsl", "module M { };"),
];

/// Checks the diagnostics for a whole file `m.idsl`.
fn check_file(text: &str, expected: &Expect) -> Library {
    let mut sources = SourceMap::new();
    let source = sources.add("m.idsl", text);
    let mut texts = OTHERS.to_vec();
    texts.push(("m.idsl", text));
    let loader = MemoryLoader::new(texts);
    let mut session = Session::new(&mut sources, &loader);
    session.load_source(source, std::path::Path::new("m.idsl"));
    let (found, library) = (session.found, session.library);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    library
}

/// Checks the diagnostics for `body`, which is in a module from line 2 on.
fn check(body: &str, expected: &Expect) -> Library {
    check_file(&format!("module M {{\n{body}\n}};\n"), expected)
}

/// The operations of the last module, in the form that the type hash covers.
fn operations(library: &Library) -> Vec<String> {
    let ids = (0..library.interfaces.len()).map(rc_idsl::model::InterfaceId);
    let texts = ids.flat_map(|id| {
        let operations = library.interface(id).operations.iter();
        operations.map(move |o| rc_idsl::canonical::operation_text(library, id, o))
    });
    texts.collect()
}

#[test]
fn a_missing_semicolon_is_one_error_at_its_location() {
    check(
        "struct S { int a\n int b; // of b\n string c /* of c */ }\nsequence<int> L\ndictionary<int, int> D // of D\n\
         const int C = 3\ninterface I {\n void a()\n int b(int x) throws E\n @unit(\"m\") command c()\n }\nexception E { }",
        &expect![[r#"
            m.idsl:2:17: error[missing-semicolon]: expected `;`
            m.idsl:4:10: error[missing-semicolon]: expected `;`
            m.idsl:5:16: error[missing-semicolon]: expected `;`
            m.idsl:6:23: error[missing-semicolon]: expected `;`
            m.idsl:7:16: error[missing-semicolon]: expected `;`
            m.idsl:9:10: error[missing-semicolon]: expected `;`
            m.idsl:10:23: error[missing-semicolon]: expected `;`
            m.idsl:11:24: error[missing-semicolon]: expected `;`
        "#]],
    );
    check_file(
        "import \"Base\"\nmodule M { }",
        &expect![[r#"
            m.idsl:1:14: error[missing-semicolon]: expected `;`
        "#]],
    );
}

#[test]
fn errors_outside_declarations() {
    check_file(
        "",
        &expect![[r#"
            m.idsl:1:1: error[empty-file]: expected `module NAME { … };`, found an empty file
        "#]],
    );
    check_file(
        "// nothing\n\n",
        &expect![[r#"
            m.idsl:1:1: error[empty-file]: expected `module NAME { … };`, found an empty file
        "#]],
    );
    check_file(
        "struct S { int a; };",
        &expect![[r#"
        m.idsl:1:1: error[syntax-error]: expected `module`, found `struct`
    "#]],
    );
    check_file(
        "module M { struct S { int a; }; }; module N { };",
        &expect![[r#"
            m.idsl:1:36: error[text-after-end]: unexpected text: a file contains one `module NAME { … };`
        "#]],
    );
    check_file(
        "module M { };\n}",
        &expect![[r#"
            m.idsl:2:1: error[text-after-end]: unexpected text: a file contains one `module NAME { … };`
        "#]],
    );
    check_file(
        "module M {\n struct S { int a; };\n",
        &expect![[r#"
            m.idsl:3:1: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
    check_file(
        "module M\n struct S { int a; };\n};",
        &expect![[r#"
        m.idsl:2:2: error[syntax-error]: expected `{`, found `struct`
    "#]],
    );
    check_file(
        "Module M { };",
        &expect![[r#"
            m.idsl:1:1: error[syntax-error]: expected `module`, found `Module` (did you mean `module`?)
        "#]],
    );
    check_file(
        "module { };",
        &expect![[r#"
        m.idsl:1:8: error[syntax-error]: expected a name, found `{`
    "#]],
    );
    check_file(
        "/* never closed\nmodule M { };",
        &expect![[r#"
            m.idsl:1:1: error[unclosed-comment]: unterminated block comment (end the comment with `*/`)
        "#]],
    );
    check_file(
        &format!(
            "module M {{ {}int{} L; }};",
            "sequence<".repeat(200),
            ">".repeat(200)
        ),
        &expect![[r#"
            m.idsl:1:911: error[nested-too-deep]: brackets are nested more than 100 levels deep
        "#]],
    );
}

#[test]
fn imports_are_resolved() {
    check_file(
        "import \"Baes.idsl\"; module M { };",
        &expect![[r#"
            m.idsl:1:8: error[import-not-found]: cannot find `Baes.idsl`; searched in memory (did you mean `Base.idsl`?)
        "#]],
    );
    check_file(
        "import \"/opt/robocomp/interfaces/Nothing.idsl\";\nmodule M { };",
        &expect![[r#"
            m.idsl:1:8: error[import-not-found]: cannot find `Nothing.idsl`; searched in memory (copy the file into one of these folders, or pass its folder with `-I DIR`)
        "#]],
    );
    check_file(
        "import Base.idsl; module M { };",
        &expect![[r#"
            m.idsl:1:8: error[syntax-error]: expected a string, found `Base`
        "#]],
    );
    check_file(
        "import \"Ring\"; module M { };",
        &expect![[r#"
            Ring.idsl:1:8: error[import-cycle]: cyclic import: m.idsl → Ring.idsl → m.idsl
        "#]],
    );
    check_file(
        "import \"m.idsl\"; module M { };",
        &expect![[r#"
            m.idsl:1:8: error[import-cycle]: cyclic import: m.idsl → m.idsl
        "#]],
    );
    check_file(
        "import \"Twin.idsl\"; module M { };",
        &expect![[r#"
            m.idsl:1:28: error[module-in-two-files]: module `M` is declared in two files: Twin.idsl and m.idsl; also declared here at Twin.idsl:1:8
        "#]],
    );
}

#[test]
fn a_syntax_error_does_not_hide_later_errors() {
    check(
        "struct A { int a, b; int [3] c; a; int d = ; int 3; float e[]; };\nstrcut B { int a; };\nenum C { A B };\n\
         enum D { A = x };\ninterface E { void a(int); void b(int x; void c int x); int; void d() throws; };\n\
         sequence<int L;\ndictionary<int> N;\nconst int O;\nStruct P { };\n§ x;\nstruct Q { string<x> a; };\n\
         struct R extends Q { int a; };\nitn z;",
        &expect![[r#"
            m.idsl:2:17: error[syntax-error]: expected `;`, `=` or `[`, found `,` (each member has a type of its own: `int a; int b;`)
            m.idsl:2:26: error[syntax-error]: expected a name, found `[` (the length follows the name: `int c[3];`)
            m.idsl:2:34: error[syntax-error]: expected a name, found `;`
            m.idsl:2:44: error[syntax-error]: expected a value, found `;`
            m.idsl:2:50: error[syntax-error]: expected a name, found `3`
            m.idsl:2:61: error[syntax-error]: expected a number, found `]`
            m.idsl:3:1: error[unknown-declaration]: expected a declaration, found `strcut` (did you mean `struct`?)
            m.idsl:4:12: error[syntax-error]: expected `,`, `=` or `}`, found `B`
            m.idsl:5:14: error[syntax-error]: expected a number, found `x`
            m.idsl:6:25: error[syntax-error]: expected a name, found `)`
            m.idsl:6:40: error[syntax-error]: expected `)` or `,`, found `;`
            m.idsl:6:49: error[syntax-error]: expected `(`, found `int`
            m.idsl:6:60: error[syntax-error]: expected a name, found `;`
            m.idsl:6:77: error[syntax-error]: expected a name, found `;`
            m.idsl:7:14: error[syntax-error]: expected `,` or `>`, found `L`
            m.idsl:8:15: error[syntax-error]: expected `,`, found `>`
            m.idsl:9:12: error[syntax-error]: expected `=`, found `;`
            m.idsl:10:1: error[unknown-declaration]: expected a declaration, found `Struct` (did you mean `struct`?)
            m.idsl:11:1: error[unknown-declaration]: expected a declaration, found `§` (expected one of `enum`, `struct`, `sequence`, `dictionary`, `exception`, `interface`, `const`)
            m.idsl:12:19: error[syntax-error]: expected a number, found `x`
            m.idsl:13:10: error[syntax-error]: expected `{`, found `extends`
            m.idsl:14:1: error[unknown-declaration]: expected a declaration, found `itn` (expected one of `enum`, `struct`, `sequence`, `dictionary`, `exception`, `interface`, `const`)
        "#]],
    );
}

#[test]
fn missing_braces_are_reported() {
    check(
        "struct A  int a; };\nstruct B { int a; };",
        &expect![[r#"
            m.idsl:2:11: error[syntax-error]: expected `{`, found `int`
            m.idsl:3:1: error[text-after-end]: unexpected text: a file contains one `module NAME { … };`
        "#]],
    );
    check(
        "struct A { int a;\nstruct B { int a; };",
        &expect![[r#"
            m.idsl:3:10: error[syntax-error]: expected `;`, `=` or `[`, found `{`
            m.idsl:5:1: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
    check(
        "interface I { void a();\nstruct B { int a; };\n};",
        &expect![[r#"
            m.idsl:3:10: error[syntax-error]: expected `(`, found `{`
        "#]],
    );
}

#[test]
fn names_are_unique_regardless_of_case() {
    check(
        "struct S { int a; int A; string a; };\nstruct s { };\nenum E { One, ONE };\ninterface I { void f(); int F(int x, out int X); };\n\
         interface S { };\nexception E { int what; };",
        &expect![[r#"
            m.idsl:2:23: error[duplicate-name]: member `A` differs only in case from `a`; first declared here at m.idsl:2:16
            m.idsl:2:33: error[duplicate-name]: member `a` is declared twice; first declared here at m.idsl:2:16
            m.idsl:3:8: error[duplicate-name]: declaration `s` differs only in case from `S`; first declared here at m.idsl:2:8
            m.idsl:4:15: error[duplicate-name]: enumerator `ONE` differs only in case from `One`; first declared here at m.idsl:4:10
            m.idsl:5:29: error[duplicate-name]: operation `F` differs only in case from `f`; first declared here at m.idsl:5:20
            m.idsl:5:46: error[duplicate-name]: parameter `X` differs only in case from `x`; first declared here at m.idsl:5:35
            m.idsl:6:11: error[duplicate-name]: declaration `S` is declared twice; first declared here at m.idsl:2:8
            m.idsl:7:11: error[duplicate-name]: declaration `E` is declared twice; first declared here at m.idsl:4:6
        "#]],
    );
    check(
        "exception A { int code; };\nexception B extends A { int code; };",
        &expect![[r#"
            m.idsl:3:29: error[duplicate-name]: member `code` is declared twice; first declared here at m.idsl:2:19
        "#]],
    );
}

#[test]
fn unknown_types_are_reported() {
    check(
        "struct S { itn a; Float b; sate c; void d; E e; const f; unsigned g; };\nexception E { };\n\
         interface I { s f(); void g(Sq x); void h() throws S; void i() throws Nothing; };",
        &expect![[r#"
            m.idsl:2:12: error[unknown-type]: unknown type `itn` (did you mean `int`?)
            m.idsl:2:19: error[unknown-type]: unknown type `Float` (did you mean `float`?)
            m.idsl:2:28: error[unknown-type]: unknown type `sate` (declare it, or import the file that does)
            m.idsl:2:36: error[void-value]: `void` is valid only as the return type of an operation
            m.idsl:2:44: error[exception-as-type]: expected a type, found exception `E` (exceptions are valid only after `throws`)
            m.idsl:2:49: error[unknown-type]: unknown type `const` (declare it, or import the file that does)
            m.idsl:2:58: error[unknown-type]: unknown type `unsigned` (did you mean `uint32`?)
            m.idsl:4:15: error[unknown-type]: unknown type `s` (did you mean `S`?)
            m.idsl:4:29: error[unknown-type]: unknown type `Sq` (did you mean `S`?)
            m.idsl:4:52: error[not-an-exception]: expected an exception, found `S`; declared here at m.idsl:2:8
            m.idsl:4:71: error[unknown-type]: unknown type `Nothing` (declare it, or import the file that does)
        "#]],
    );
    check_file(
        "import \"Base\";\nimport \"Other\";\nmodule M {\nstruct A { Base::State a; Base::Sate b; Bsae::State c; State d; Other::Broken e; };\n\
         interface I { void f() throws Base::Broken; void g() throws Broken; void h() throws Other::Broken; };\n};",
        &expect![[r#"
            m.idsl:4:27: error[unknown-type]: unknown type `Base::Sate` (did you mean `State`?)
            m.idsl:4:41: error[unknown-module]: module `Bsae` is not imported (did you mean `Base`?)
            m.idsl:4:56: error[ambiguous-type]: ambiguous type `State`: found `Base::State` and `Other::State` (write `Base::State`)
            m.idsl:4:65: error[type-moved]: module `Other` has no type `Broken`; found `Base::Broken` (write `Base::Broken`)
            m.idsl:5:61: warning[unscoped-name]: unscoped name `Broken` refers to `Base::Broken` (write `Base::Broken`)
            m.idsl:5:85: error[type-moved]: module `Other` has no type `Broken`; found `Base::Broken` (write `Base::Broken`)
        "#]],
    );
    check_file(
        "import \"Deep\";\nmodule M {\nstruct A { Base::State a; Deep::State b; State c; };\n};",
        &expect![[r#"
            m.idsl:3:27: error[type-moved]: module `Deep` has no type `State`; found `Base::State` (write `Base::State`)
            m.idsl:3:42: warning[unscoped-name]: unscoped name `State` refers to `Base::State` (write `Base::State`)
        "#]],
    );
    check(
        "struct A { Base::State a; };",
        &expect![[r#"
            m.idsl:2:12: error[unknown-module]: module `Base` is not imported (import the file that declares it)
        "#]],
    );
}

#[test]
fn sizes_of_types_are_checked() {
    check(
        "struct A { B b; };\nstruct B { sequence<C> c; };\nstruct C { A a[2]; };\nstruct D { D d; };\nsequence<F> F;",
        &expect![[r#"
            m.idsl:2:8: error[recursive-type]: type `A` contains itself: A → B → C → A
            m.idsl:5:8: error[recursive-type]: type `D` contains itself: D → D
            m.idsl:6:13: error[recursive-type]: type `F` contains itself: F → F
        "#]],
    );
    check(
        "struct A { int a[0]; string<0> b; sequence<int, -1> c; int d[4294967296]; int e[1.5]; };",
        &expect![[r#"
            m.idsl:2:18: error[bad-bound]: expected a bound from 1 to 4294967295
            m.idsl:2:29: error[bad-bound]: expected a bound from 1 to 4294967295
            m.idsl:2:49: error[bad-bound]: expected a bound from 1 to 4294967295
            m.idsl:2:62: error[bad-bound]: expected a bound from 1 to 4294967295
            m.idsl:2:81: error[bad-bound]: expected a bound from 1 to 4294967295
        "#]],
    );
    check(
        "struct S { int a; };\ndictionary<S, int> A;\ndictionary<float, int> B;\ndictionary<sequence<int>, int> C;",
        &expect![[r#"
            m.idsl:3:12: error[dictionary-key]: invalid type for the key of a dictionary (use a bool, an integer, a string or an enum)
            m.idsl:4:12: error[dictionary-key]: invalid type for the key of a dictionary (use a bool, an integer, a string or an enum)
            m.idsl:5:12: error[dictionary-key]: invalid type for the key of a dictionary (use a bool, an integer, a string or an enum)
        "#]],
    );
}

#[test]
fn values_fit_their_types() {
    check(
        "enum E { A, B = 7, C = 7, D = 3000000000 };\nenum F { };\n\
         struct S { bool a = 1; byte b = 256; int c = \"x\"; string<2> d = \"abc\"; E e = Z; E f = 3; float g = 1; sequence<int> h = 3; long i = 9223372036854775808; };\n\
         const S K = 3;\nconst int L = 1.5;",
        &expect![[r#"
            m.idsl:2:20: error[enum-value]: `C` has the same value as `B`; first used here at m.idsl:2:13
            m.idsl:2:31: error[enum-value]: expected a 32-bit integer as the value of an enumerator
            m.idsl:3:6: error[empty-enum]: enum `F` has no values
            m.idsl:4:21: error[bad-default]: expected `true` or `false`, found the number 1
            m.idsl:4:33: error[bad-default]: expected an integer from 0 to 255, found the number 256
            m.idsl:4:46: error[bad-default]: expected an integer from -2147483648 to 2147483647, found the string "x"
            m.idsl:4:65: error[bad-default]: expected a string of at most 2 bytes, found the string "abc"
            m.idsl:4:78: error[bad-default]: enum `E` has no value `Z` (expected one of `A`, `B`, `C`, `D`)
            m.idsl:4:87: error[bad-default]: expected a value of enum `E`, found the number 3 (expected one of `A`, `B`, `C`, `D`)
            m.idsl:4:121: error[bad-default]: sequences, arrays and dictionaries cannot have a default value (remove the default: the initial value is empty or zero)
            m.idsl:4:133: error[bad-default]: expected an integer from -9223372036854775808 to 9223372036854775807, found the number 9223372036854775808
            m.idsl:5:7: error[const-type]: invalid type for a constant (use a number, a bool or a string)
            m.idsl:6:15: error[bad-default]: expected an integer from -2147483648 to 2147483647, found the number 1.5
        "#]],
    );
    check(
        "struct S { @range(min=3, max=1) int a; @range(0, 1) int b; @range(min=0) string c; @range(min=0, max=10) int d = 11;\n\
         @unit(3) int e; @optional(1) int f; @default int g; @rnage(min=0) int h; @key int i; @range(min=0.5) int j; };",
        &expect![[r#"
            m.idsl:2:13: error[bad-range]: empty range: `min` is greater than `max`
            m.idsl:2:41: error[bad-range]: expected the arguments `min=` and `max=`: `@range(min=0, max=100)`
            m.idsl:2:61: error[bad-range]: `@range` requires a number
            m.idsl:2:114: error[default-out-of-range]: the default 11 of `d` is outside its range
            m.idsl:3:2: error[annotation-arguments]: `@unit` takes one string: `@unit("m/s")`
            m.idsl:3:18: error[annotation-arguments]: `@optional` takes no argument
            m.idsl:3:38: error[annotation-arguments]: `@default` takes one value: `@default(0)`
            m.idsl:3:54: warning[unknown-annotation]: unknown annotation `@rnage` (did you mean `range`?)
            m.idsl:3:75: warning[unknown-annotation]: unknown annotation `@key` (expected one of `unit`, `dproto`, `range`, `default`, `optional`, `stamp`)
            m.idsl:3:87: error[bad-range]: the limits of `@range` must be numbers of the member's type
        "#]],
    );
}

#[test]
fn ros_annotations_are_valid_in_their_places_only() {
    let library = check_file(
        "@ros(\"a_msgs\") module M {
         @ros(\"a/msg/B\") struct S { @ros(\"a/msg/C\") int x; };
         @ros(\"a/msg/D\") enum E { e };
         @ros @ros(a=\"b\") @ros(\"x\", \"y\") struct T { int x; };
         @ros(\"a/msg/F\") @ros(\"a/msg/G\") struct U { int x; };
         interface I { @ros(\"a/msg/H\") @ros(\"a/srv/H\") void go(); };
         };",
        &expect![[r#"
            m.idsl:2:38: warning[unknown-annotation]: `@ros` is ignored here (move it before a module, a struct or an operation)
            m.idsl:3:11: warning[unknown-annotation]: `@ros` is ignored here (move it before a module, a struct or an operation)
            m.idsl:4:11: error[annotation-arguments]: `@ros` takes one string: `@ros("sensor_msgs/msg/LaserScan")`
            m.idsl:4:16: error[annotation-arguments]: `@ros` takes one string: `@ros("sensor_msgs/msg/LaserScan")`
            m.idsl:4:28: error[annotation-arguments]: `@ros` takes one string: `@ros("sensor_msgs/msg/LaserScan")`
            m.idsl:5:31: error[annotation-arguments]: duplicate annotation `@ros`; first used here at m.idsl:5:15
        "#]],
    );
    let text = |name: &rc_syntax::Name| name.text.clone();
    let module = library.modules[0].ros_package.as_ref().map(text);
    assert_eq!(module.as_deref(), Some("a_msgs"));
    let types: Vec<_> = library
        .types
        .iter()
        .map(|t| t.ros_type.as_ref().map(text))
        .collect();
    let some = |name: &str| Some(name.to_owned());
    assert_eq!(types, [some("a/msg/B"), None, None, some("a/msg/F")]);
    let operation: Vec<_> = library.interfaces[0].operations[0]
        .ros_types
        .iter()
        .map(text)
        .collect();
    assert_eq!(operation, ["a/msg/H", "a/srv/H"]);
}

#[test]
fn patterns_agree_with_results() {
    check(
        "interface I { command int a(); publish void b(out int x); publish void c() throws E; query void d(); command e(int x); query f(out int x); };\nexception E { };",
        &expect![[r#"
            m.idsl:2:15: error[result-of-one-way]: command `a` cannot have a result (make it a `query`, or remove the return value, `out` parameters and `throws`)
            m.idsl:2:32: error[result-of-one-way]: publish `b` cannot have a result (make it a `query`, or remove the return value, `out` parameters and `throws`)
            m.idsl:2:59: error[result-of-one-way]: publish `c` cannot have a result (make it a `query`, or remove the return value, `out` parameters and `throws`)
        "#]],
    );
    check(
        "exception A extends B { };\nexception B { };\nstruct S { };\nexception C extends S { };",
        &expect![[r#"
            m.idsl:2:21: error[not-an-exception]: expected an exception declared before this one, found `B`
            m.idsl:5:21: error[not-an-exception]: expected an exception declared before this one, found `S`
        "#]],
    );
}

#[test]
fn declarations_may_be_in_any_order() {
    check(
        "struct A { E e = Two; L l; L m = 3; Oops o; };\ndictionary<E, int> D;\nenum E { One, Two };\nsequence<int> L;\nexception Oops { };",
        &expect![[r#"
            m.idsl:2:34: error[bad-default]: sequences, arrays and dictionaries cannot have a default value (remove the default: the initial value is empty or zero)
            m.idsl:2:37: error[exception-as-type]: expected a type, found exception `Oops` (exceptions are valid only after `throws`)
        "#]],
    );
}

#[test]
fn shared_types_are_visited_once() {
    let mut body = String::from("struct S0 { int x; };");
    for at in 1..60 {
        let before = at - 1;
        body.push_str(&format!("struct S{at} {{ S{before} a; S{before} b; }};"));
    }
    check(&body, &expect![[""]]);
}

#[test]
fn an_interface_without_operations_is_accepted() {
    check("interface I { };", &expect![[""]]);
}

#[test]
fn the_habits_of_robocomp_are_accepted() {
    let library = check_file(
        "\u{feff}import \"/opt/robocomp/interfaces/IDSLs/Base.idsl\";\r\nimport \"../..//Other\";\r\nmodule M\r\n{\r\n\
         \tsequence <float> Floats;\tdictionary< string , Floats > Table;\r\n\
         \tenum Mode{ None, Some=5, default, };\r\n\tstruct T { int type; int fn; int match = 0; };\r\n\
         \tinterface I { void publish(int command); int command(string query, out bool out_); void query(); idempotent Floats match(); };\r\n}",
        &expect![[""]],
    );
    let expected = expect![[r#"
        M::I/publish(command:int32;)->()
        M::I/command(query:string<>;)->(out_:bool;return:int32)
        M::I/query()->()
        M::I/match()->(return:sequence<float32>)"#]];
    expected.assert_eq(&operations(&library).join("\n"));
}

#[test]
fn constructs_of_real_files_are_accepted() {
    // RoboComp treats any run of `;` as one, and allows types with the names of patterns.
    let library = check_file(
        "import \"Base.idsl\";;\nmodule M {\nstruct query { int a;; int b; };;\nenum E { None, };; sequence<int> L;;\n\
         interface I { query get();; query again(int x); command stop(); void type(); };\n};;",
        &expect![[""]],
    );
    let text = operations(&library).join("\n");
    assert!(text.contains("M::I/get()->(return:M::query{"), "{text}");
    assert!(text.contains("M::I/stop()->()"), "{text}");
    // One cause gives one message.
    check(
        "struct S { int a b; unsigned int c; };\nvector<int> V;\nstruct T { Nowhere::X x; };",
        &expect![[r#"
            m.idsl:2:18: error[syntax-error]: expected `;`, `=` or `[`, found `b`
            m.idsl:2:34: error[syntax-error]: expected `;`, `=` or `[`, found `c` (write `uint16`, `uint32` or `uint64` instead of an `unsigned` type)
            m.idsl:3:1: error[unknown-declaration]: expected a declaration, found `vector` (write `sequence<TYPE> NAME;`)
            m.idsl:4:12: error[unknown-module]: module `Nowhere` is not imported (import the file that declares it)
        "#]],
    );
    check_file(
        "#ifndef M\n#define M\nmodule M { };\n#endif",
        &expect![[r#"
            m.idsl:1:1: error[syntax-error]: expected `module`, found `#` (delete the include guard: each file is read only once)
        "#]],
    );
    check_file(
        "module M { };\n#endif",
        &expect![[r#"
            m.idsl:2:1: error[text-after-end]: unexpected text: a file contains one `module NAME { … };` (delete the include guard: each file is read only once)
        "#]],
    );
}

#[test]
fn numbers_have_the_whole_range_of_their_types() {
    check(
        "const uint64 A = 18446744073709551615;\nconst uint64 B = 0xFFFFFFFFFFFFFFFF;\n\
         const int64 C = -0x8000000000000000;\nconst uint64 D = 9223372036854775808;\n\
         struct S { @range(min=1, max=18446744073709551615) uint64 a = 18446744073709551615; };\n\
         const float E = 3e38;\nconst double F = 1e308;",
        &expect![[""]],
    );
    check(
        "const uint64 A = 18446744073709551616;\nconst int64 B = 9223372036854775808;\n\
         enum E { x = 2147483647, y, z };\nconst double C = 1e400;\nconst float D = 1e39;\n\
         struct S { @range(max=256) byte a; @range(max=1e400) double b; @range(min=9223372036854775807) int64 c = 9223372036854775806; };\n\
         const int F = 010;",
        &expect![[r#"
            m.idsl:2:18: error[bad-default]: expected an integer from 0 to 18446744073709551615, found the number 18446744073709551616
            m.idsl:3:17: error[bad-default]: expected an integer from -9223372036854775808 to 9223372036854775807, found the number 9223372036854775808
            m.idsl:4:26: error[enum-value]: the value of `y` would be 2147483648, which is no 32-bit integer (give it a value of its own, as in `last = 7`)
            m.idsl:5:18: error[bad-default]: expected a number within the range of `float64`, found a number that is too large
            m.idsl:6:17: error[bad-default]: expected a number within the range of `float32`, found the number 1e39
            m.idsl:7:13: error[bad-range]: the limits of `@range` must be numbers of the member's type
            m.idsl:7:37: error[bad-range]: the limits of `@range` must be numbers of the member's type
            m.idsl:7:106: error[default-out-of-range]: the default 9223372036854775806 of `c` is outside its range
            m.idsl:8:15: warning[leading-zero]: `010` is the decimal number 10, not an octal one (write `10`)
        "#]],
    );
}

#[test]
fn a_letter_that_looks_like_another_is_named() {
    check(
        "struct S { int \u{430}; };",
        &expect![[r#"
            m.idsl:2:16: error[syntax-error]: expected a name, found `а` (with U+0430)
        "#]],
    );
}

#[test]
fn a_range_before_an_operation_is_that_of_its_result() {
    let library = check(
        "interface I {\n @range(min=0, max=9) int one();\n @range(max=1) void two();\n @range(max=1) string three();\n};",
        &expect![[r#"
            m.idsl:4:3: warning[unknown-annotation]: `@range` is ignored here: the operation has no result (move it before a parameter)
            m.idsl:5:3: error[bad-range]: `@range` requires a number
        "#]],
    );
    let operations = &library.interface(rc_idsl::model::InterfaceId(0)).operations;
    assert!(operations[0].result_range.is_some());
}

#[test]
fn a_character_that_nobody_sees_is_the_only_error_of_its_declaration() {
    check(
        "struct S {\n int\u{a0}a;\n int b; // \u{a0}\n flaot c;\n};\nconst string T = \u{201c}x\u{201d};\n\
         const string U = \"\\d\";\nconst int V = 3 sec;",
        &expect![[r#"
            m.idsl:3:5: error[stray-character]: unexpected character U+00A0 (a no-break space) (delete it, or write a space)
            m.idsl:5:2: error[unknown-type]: unknown type `flaot` (did you mean `float`?)
            m.idsl:7:18: error[stray-character]: unexpected character U+201C (a typographic quote) (write `"`)
            m.idsl:7:20: error[stray-character]: unexpected character U+201D (a typographic quote) (write `"`)
            m.idsl:8:19: error[unknown-escape]: unknown escape `\d` (write `\\d` for a backslash; the escapes are `\n`, `\r`, `\t`, `\"`, `\\` and `\u{…}`)
            m.idsl:9:17: error[unknown-time-unit]: unknown unit of time `sec` (write `s` for seconds)
        "#]],
    );
}

#[test]
fn habits_of_other_languages_get_the_way_to_write_it_here() {
    check(
        "struct S { float[3] a; int[] b; string s = 'q'; };\n\
         interface I { bool get(int a, int& b); void f(const string s); void g(in S s); void h(inout S s); void k(&s); };",
        &expect![[r#"
            m.idsl:2:17: error[syntax-error]: expected a name, found `[` (the length follows the name: `float a[3];`)
            m.idsl:2:27: error[syntax-error]: expected a name, found `[` (write `sequence<int> b;`)
            m.idsl:2:44: error[syntax-error]: expected a value, found `'` (a string has double quotes: `"text"`)
            m.idsl:3:34: error[syntax-error]: expected a name, found `&` (write `out int NAME` for a result, and `int NAME` for an input)
            m.idsl:3:60: error[syntax-error]: expected `)` or `,`, found `s` (remove `const`: a parameter without `out` is an input)
            m.idsl:3:76: error[syntax-error]: expected `)` or `,`, found `s` (remove `in`: a parameter without `out` is an input)
            m.idsl:3:95: error[syntax-error]: expected `)` or `,`, found `s` (write a parameter for the input, and one with `out` for the result)
            m.idsl:3:106: error[syntax-error]: expected `)` or a parameter, found `&`
        "#]],
    );
    // A comment before the error ends with a sign of several bytes.
    check(
        "struct S { float // →\n[3] a; };\ninterface I { void f(int // →\n& a); };",
        &expect![[r#"
            m.idsl:3:1: error[syntax-error]: expected a name, found `[`
            m.idsl:5:1: error[syntax-error]: expected a name, found `&`
        "#]],
    );
    check_file(
        "# A comment.\nmodule M { };",
        &expect![[r#"
        m.idsl:1:1: error[syntax-error]: expected `module`, found `#` (a comment begins with `//`)
    "#]],
    );
}
