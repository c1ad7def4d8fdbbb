//! Completion in real shells: commands, options, and the names of a network that runs.

use crate::pty::{SETSID, Terminal};
use rc_test_site::site::Site;
use rc_test_support::debian;
use rc_test_support::python::skipped;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A network that runs. The shells find `rcdeploy` in the path.
fn up(name: &str) -> Site {
    let site = Site::new(name);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site
}

fn command(site: &Site, program: &Path) -> Command {
    let mut command = site.command(program);
    let tools = Path::new(env!("CARGO_BIN_EXE_rcdeploy"))
        .parent()
        .expect("a folder");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = [tools.to_path_buf()]
        .into_iter()
        .chain(std::env::split_paths(&path));
    command.env("PATH", std::env::join_paths(all).expect("a path"));
    command
}

fn script(shell: &str) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_rcdeploy"))
        .args(["completions", shell])
        .output();
    String::from_utf8(output.expect("to run").stdout).expect("text")
}

/// A program of a Debian package: that of the system, else one below the target folder.
fn installed(package: &str, program: &str, test: &str) -> Option<(PathBuf, PathBuf)> {
    let library = |place: &Path| {
        place
            .join("usr/lib")
            .join(format!("{}-linux-gnu", std::env::consts::ARCH))
    };
    let works = |place: &Path| {
        let mut command = Command::new(place.join(program));
        command
            .arg("--version")
            .env("LD_LIBRARY_PATH", library(place));
        command.output().is_ok_and(|output| output.status.success())
    };
    let root = Path::new("/");
    match debian::provided(package, &|place| works(place.unwrap_or(root))) {
        Ok(place) => {
            let place = place.as_deref().unwrap_or(root);
            Some((place.join(program), library(place)))
        }
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

/// Types at the prompt of a shell as a user would.
fn type_and_press_tab(site: &Site, mut terminal: Terminal) {
    let network = &site.network;
    terminal.until_text("ready$");
    for (typed, completed) in [
        (
            "rcdeploy stat".to_owned(),
            "ready$ rcdeploy status".to_owned(),
        ),
        (
            format!("rcdeploy status {}", &network[..6]),
            format!("ready$ rcdeploy status {network}"),
        ),
        (
            format!("rcdeploy restart {network} mon"),
            format!("restart {network} monitor"),
        ),
        (
            format!("rcdeploy params set --format json {network} avoider sa"),
            "avoider safe_distance=".to_owned(),
        ),
        (
            format!("rcdeploy logs {network} si"),
            format!("rcdeploy logs {network} simulator"),
        ),
        (
            format!("rcdeploy echo {network} simulator.Full"),
            "simulator.FullPoseEstimationPub.newFullPose".to_owned(),
        ),
        (
            format!("rcdeploy hz {network} simulator.Full"),
            "simulator.FullPoseEstimationPub.newFullPose".to_owned(),
        ),
        (
            format!("rcdeploy call {network} simulator.Laser.getLaserC"),
            "simulator.Laser.getLaserConfData".to_owned(),
        ),
        (
            format!("rcdeploy fire {network} avoider st"),
            format!("fire {network} avoider stop"),
        ),
        (
            "rcdeploy check pat".to_owned(),
            "ready$ rcdeploy check patrol.ddsl".to_owned(),
        ),
    ] {
        terminal.press(&format!("{typed}\t"));
        terminal.until_text(&completed);
        // Ctrl-U, which empties the line.
        terminal.press("\u{15}");
        terminal.until("an empty line", |screen| {
            !screen.contents().contains(&completed)
        });
    }
    terminal.press("exit\r");
    terminal.end();
}

#[test]
fn bash_completes_the_names_of_a_running_network() {
    let site = up("bash");
    let rc = site.write("bashrc", &(script("bash") + "PS1='ready$ '\nHISTFILE=\n"));
    let mut bash = command(&site, Path::new(SETSID[0]));
    bash.args([SETSID[1], "bash", "--noprofile", "--rcfile"])
        .arg(rc)
        .arg("-i");
    type_and_press_tab(&site, Terminal::start(bash, (150, 20)));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}

/// The script lies in a folder of `fpath`, as it does when it is installed.
#[test]
fn zsh_completes_the_names_of_a_running_network() {
    let test = "zsh_completes_the_names_of_a_running_network";
    let Some((zsh, library)) = installed("zsh --no-install-recommends", "bin/zsh", test) else {
        return;
    };
    let site = up("zsh");
    let place = zsh
        .ancestors()
        .nth(2)
        .expect("its folder")
        .display()
        .to_string();
    let functions = site.path("functions");
    std::fs::create_dir(&functions).expect("a folder");
    std::fs::write(functions.join("_rcdeploy"), script("zsh")).expect("written");
    let rc = format!(
        "module_path=({}/zsh/*)\nfpath=({} {place}/usr/share/zsh/functions/**/*(/))\n\
         autoload -Uz compinit\ncompinit -u -D\nPS1='ready$ '\nHISTFILE=\n",
        library.display(),
        functions.display()
    );
    site.write(".zshrc", &rc);
    let mut command = command(&site, Path::new(SETSID[0]));
    command.arg(SETSID[1]).arg(zsh).args(["-d", "-i"]);
    command
        .env("ZDOTDIR", site.path("networks"))
        .env("LD_LIBRARY_PATH", &library);
    type_and_press_tab(&site, Terminal::start(command, (150, 20)));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}

/// fish completes a line on request, without a terminal.
#[test]
fn fish_completes_the_names_of_a_running_network() {
    let test = "fish_completes_the_names_of_a_running_network";
    let Some((fish, library)) = installed("fish --no-install-recommends", "usr/bin/fish", test)
    else {
        return;
    };
    let site = up("fish");
    let network = site.network.as_str();
    let complete = |line: &str| {
        let mut command = command(&site, &fish);
        let script = format!("rcdeploy completions fish | source; complete --do-complete '{line}'");
        command.args(["--no-config", "--command", &script]);
        command
            .env("LD_LIBRARY_PATH", &library)
            .env("HOME", site.path("run"));
        let ran = site.run(command);
        let values = ran
            .stdout
            .lines()
            .filter_map(|line| line.split('\t').next());
        values.map(str::to_owned).collect::<Vec<String>>()
    };
    assert_eq!(complete("rcdeploy stat"), ["status"]);
    assert_eq!(complete("rcdeploy down f"), [network]);
    let all = ["avoider", "monitor", "simulator"];
    let names = complete(&format!("rcdeploy logs {network} "));
    assert_eq!(names[..3], all);
    assert_eq!(
        complete(&format!("rcdeploy emergency {network} avoider o")),
        ["on", "off"]
    );
    let topic = "simulator.FullPoseEstimationPub.newFullPose";
    for command in ["echo", "hz", "bw", "delay", "send"] {
        let topics = complete(&format!("rcdeploy {command} {network} simulator.Full"));
        assert_eq!(topics, [topic], "{command}");
    }
    for command in ["call", "echo"] {
        let operations = complete(&format!(
            "rcdeploy {command} {network} simulator.Laser.getLaserC"
        ));
        assert_eq!(
            operations,
            ["simulator.Laser.getLaserConfData"],
            "{command}"
        );
    }
    assert_eq!(
        complete(&format!("rcdeploy fire {network} avoider st")),
        ["stop"]
    );
    let paths = complete(&format!("rcdeploy params set {network} avoider safe"));
    assert_eq!(paths, ["safe_distance="]);
    // A network that does not run, and one that is broken: options only, and no message.
    let options = ["--format", "--color", "--help"];
    assert_eq!(complete("rcdeploy restart nowhere "), options);
    let broken = site.write("broken.ddsl", "Deployment");
    let restart = format!("rcdeploy restart {} ", broken.display());
    assert_eq!(complete(&restart), options);
    assert_eq!(site.rcdeploy(&["down", network], false).code, 0);
}
