//! Rules between parameters, for values of every type, and what a broken one says.

use super::check::{load, read};
use expect_test::expect;

const RULES: &str = r#"ComponentParams P {
    simulated bool false;
    real bool true;
    width double 2;
    height double 3;
    pause duration 10ms;
    turns int 3;
    gains double[] [];
    pauses duration[] [];
    names string[] [];
    flags bool[] [];
    numbers int[] [];
    list motors 0:9 { id int 0; tags string[] []; };
    require not (simulated and real) "it is one of both";
    require width * height <= 6 "the area is too large";
    require turns * pause <= 30ms and pause * turns <= 30ms "it takes too long";
    require unique(gains) "equal gains";
    require unique(pauses) "equal pauses";
    require unique(names) "equal names";
    require unique(flags) "equal flags";
    require unique(numbers) "equal numbers";
    require len(numbers) < 4 "too many numbers";
    require len(motors.tags) < 3 "too many tags";
    require len(motors) < 2 "too many motors";
};"#;

fn found(parameters: &str) -> String {
    let text = format!("[parameters]\n{parameters}\n");
    read(&text, Some(&load(RULES))).2
}

#[test]
fn values_of_every_type_follow_rules_and_break_them() {
    for kept in [
        "",
        "simulated = true\nreal = false",
        "width = 1.5\nheight = 4",
        "pause = '5ms'\nturns = 6",
        "gains = [1, 2.5, -1]",
        "pauses = ['1ms', '2ms']",
        "names = ['a', 'b', 'A']",
        "flags = [true, false]",
        "numbers = [3, 2, 1]",
        "motors = [{ tags = ['a', 'b'] }]",
    ] {
        assert_eq!(found(kept), "", "{kept}");
    }
    let broken = [
        "simulated = true",
        "width = 2.5",
        "turns = 4",
        "gains = [1, 2.5, 1.0]",
        "gains = [0.0, -0.0]",
        "pauses = ['1ms', '2ms', '1000us']",
        "names = ['a', 'b', 'a']",
        "flags = [true, true]",
        "numbers = [3, 2, 3]",
        "numbers = [3, 2, 1, 0]",
        "motors = [{ tags = ['a', 'b', 'c'] }]",
        "motors = [{}, {}]",
        "motors = [{ tags = ['a', 'b'] }, { tags = ['c'] }]",
    ];
    expect![[r#"
        config.toml:2:13: error[rule-broken]: `simulated` breaks a rule: it is one of both (`not (simulated and real)` does not hold: `simulated` is true, `real` is true by default)
        config.toml:2:9: error[rule-broken]: `width` breaks a rule: the area is too large (`width * height <= 6` does not hold: `width` is 2.5, `height` is 3.0 by default)
        config.toml:2:9: error[rule-broken]: `turns` breaks a rule: it takes too long (`turns * pause <= 30ms and pause * turns <= 30ms` does not hold: `turns` is 4, `pause` is "10ms" by default)
        config.toml:2:18: error[rule-broken]: `gains[2]` breaks a rule: equal gains; `gains[0]` at config.toml:2:10 (`unique(gains)` does not hold: `gains[2]` is 1.0, `gains[0]` is 1.0)
        config.toml:2:15: error[rule-broken]: `gains[1]` breaks a rule: equal gains; `gains[0]` at config.toml:2:10 (`unique(gains)` does not hold: `gains[1]` is -0.0, `gains[0]` is 0.0)
        config.toml:2:25: error[rule-broken]: `pauses[2]` breaks a rule: equal pauses; `pauses[0]` at config.toml:2:11 (`unique(pauses)` does not hold: `pauses[2]` is "1ms", `pauses[0]` is "1ms")
        config.toml:2:20: error[rule-broken]: `names[2]` breaks a rule: equal names; `names[0]` at config.toml:2:10 (`unique(names)` does not hold: `names[2]` is "a", `names[0]` is "a")
        config.toml:2:16: error[rule-broken]: `flags[1]` breaks a rule: equal flags; `flags[0]` at config.toml:2:10 (`unique(flags)` does not hold: `flags[1]` is true, `flags[0]` is true)
        config.toml:2:18: error[rule-broken]: `numbers[2]` breaks a rule: equal numbers; `numbers[0]` at config.toml:2:12 (`unique(numbers)` does not hold: `numbers[2]` is 3, `numbers[0]` is 3)
        config.toml:2:11: error[rule-broken]: `numbers` breaks a rule: too many numbers (`len(numbers) < 4` does not hold: `numbers` has length 4)
        config.toml:2:10: error[rule-broken]: `motors` breaks a rule: too many tags (`len(motors.tags) < 3` does not hold: `motors` has 3 `tags` in all)
        config.toml:2:10: error[rule-broken]: `motors` breaks a rule: too many motors (`len(motors) < 2` does not hold: `motors` has length 2)
        config.toml:2:10: error[rule-broken]: `motors` breaks a rule: too many tags (`len(motors.tags) < 3` does not hold: `motors` has 3 `tags` in all)
        config.toml:2:10: error[rule-broken]: `motors` breaks a rule: too many motors (`len(motors) < 2` does not hold: `motors` has length 2)
    "#]].assert_eq(&broken.map(found).concat());
}
