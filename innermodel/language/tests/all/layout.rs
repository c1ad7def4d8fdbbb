//! The layout of a text.

use crate::{right, scenes};
use expect_test::expect;
use innermodel_language::{format, is_innermodel};

#[test]
fn one_element_a_line() {
    let text = "<?xml version=\"1.0\"?><!-- A world. -->\n\n\n\n<innerModel   units = 'metres'\n >\n\t<transform id='a'\n\t tx=\"1\"   ty='2' ><!-- here --><imu id=\"i\"   />\n\n\n  <imu id='j'/> <!-- j -->\n<transform id=\"b\"></transform>\n <plane id='p' texture='a > b' />stray --> \n</transform></innerModel>\n\n";
    let formatted = format(text);
    expect![[r#"
        <?xml version="1.0"?> <!-- A world. -->

        <innerModel units='metres'>
            <transform id='a' tx="1" ty='2'> <!-- here -->
                <imu id="i"/>

                <imu id='j'/> <!-- j -->
                <transform id="b"></transform>
                <plane id='p' texture='a > b'/>
                stray -->
            </transform>
        </innerModel>
    "#]]
    .assert_eq(&formatted);
    assert_eq!(format(&formatted), formatted);
    assert_eq!(right(&formatted), right(text));
}

#[test]
fn scenes_are_formatted() {
    for path in scenes() {
        let text = std::fs::read_to_string(&path).expect("a scene");
        assert_eq!(format(&text), text, "{}", path.display());
    }
}

#[test]
fn other_files_are_recognised() {
    assert!(is_innermodel(
        "\u{feff}<?xml?> <!-- <a/> --> <INNERMODEL units='metres'>"
    ));
    assert!(!is_innermodel("<!-- <innerModel> --><package/>"));
    assert!(!is_innermodel("innerModel"));
}
