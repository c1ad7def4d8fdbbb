//! Layout by the formatter.

use super::{Style, format};

fn fmt(style: Style, text: &str) -> String {
    let once = format(text, style);
    assert_eq!(format(&once, style), once, "formatted twice");
    once
}

#[test]
fn blocks_comments_and_blank_lines() {
    let text = "import  \"a.idsl\" ;module M{ // of M\n/** about\n      * s */ struct S{int a;int b ; /* last */\n\n\n\n sequence <T,4> c ;}\n\n};// end";
    let style = Style {
        angle_brackets: true,
        enum_blocks: true,
        ..Style::default()
    };
    let wanted = "\
import \"a.idsl\";
module M
{ // of M
    /** about
     * s */
    struct S
    {
        int a;
        int b; /* last */

        sequence<T, 4> c;
    };

}; // end
";
    assert_eq!(
        fmt(style, text),
        wanted.replace("\n\n}; // end", "\n}; // end")
    );
}

#[test]
fn an_enumeration_stays_in_its_line_where_it_fits() {
    let style = Style {
        angle_brackets: true,
        enum_blocks: true,
        ..Style::default()
    };
    let wanted = "enum E { a, b = -3, c };\n";
    assert_eq!(fmt(style, "enum E{a,b=-3,c}"), wanted);
    let wanted = "enum E\n{\n    a, // one\n    b\n};\n";
    assert_eq!(fmt(style, "enum E{a,// one\nb}"), wanted);
    let many: Vec<String> = (0..40).map(|n| format!("name{n}")).collect();
    let text = fmt(style, &format!("enum E {{{}}}", many.join(",")));
    assert_eq!(text.lines().count(), 43);
}

#[test]
fn settings_and_choices_stay_in_their_statement() {
    let style = Style {
        inline_braces_from: Some(2),
        ..Style::default()
    };
    let text = "Component C{Communications{publishes A{depth 5;},B(dds) as b;}language rust;}";
    let wanted = "Component C\n{\n    Communications\n    {\n        publishes A { depth 5; }, B(dds) as b;\n    };\n    language rust;\n};\n";
    assert_eq!(fmt(style, text), wanted);
    let text = "x string \"a\"{\"a\",\"b\"}T unit\"m\";y int -1 -5:5;z duration 5 ms 1ms :1 s;require a<b and(len(l)-1>=2)\"m\";";
    let wanted = "x string \"a\" { \"a\", \"b\" } T unit \"m\";\ny int -1 -5:5;\nz duration 5ms 1ms:1s;\nrequire a < b and (len(l)-1 >= 2) \"m\";\n";
    assert_eq!(fmt(Style::default(), text), wanted);
}

#[test]
fn long_statements_break_after_commas() {
    let names: Vec<String> = (0..24).map(|n| format!("Interface{n}")).collect();
    let text = fmt(Style::default(), &format!("requires {};", names.join(" ,")));
    assert!(text.lines().all(|l| l.len() <= 100), "{text}");
    assert!(
        text.lines().skip(1).all(|l| l.starts_with("    Interface")),
        "{text}"
    );
    let text = "requires A, // first\n  // own line\n B /* in */ , C;";
    let wanted = "requires A, // first\n    // own line\n    B /* in */, C;\n";
    assert_eq!(fmt(Style::default(), text), wanted);
}

#[test]
fn broken_text_ends() {
    for text in [
        "}}}", "{{{", "a { b", "\"", "/*", "é ; }", "a { , }", "@ ( [",
    ] {
        format(text, Style::default());
    }
}
