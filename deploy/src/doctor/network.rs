//! The checks of what stands between machines: the firewall, and the steps of the clock.

use super::{Finding, Machine};
use std::os::unix::fs::MetadataExt;
use std::time::{SystemTime, UNIX_EPOCH};

/// The ports of DDS in the first ten domains (OMG DDSI-RTPS 2.5, 9.6.2.3).
const PORTS: &str = "7400:9900";

/// Services of firewalls: their names, the file that shows that one is on, a text that it has then, and
/// the command that lets DDS pass.
const FIREWALLS: [(&str, &str, &str, &str); 3] = [
    (
        "ufw",
        "/etc/ufw/ufw.conf",
        "ENABLED=yes",
        "ufw allow proto udp from any to any port 7400:9900",
    ),
    (
        "firewalld",
        "/run/firewalld.pid",
        "",
        "firewall-cmd --permanent --add-port=7400-9900/udp && firewall-cmd --reload",
    ),
    (
        "nftables",
        "/etc/nftables.conf",
        "policy drop",
        "a rule `udp dport 7400-9900 accept` in /etc/nftables.conf, then nft -f /etc/nftables.conf",
    ),
];

/// How far the clock may have moved since the boot. Slower corrections are usual.
const STEP: i64 = 30;

impl Machine<'_> {
    /// A firewall drops DDS between machines; inside of a machine it matters to nobody. Its rules are
    /// for root only, so this is a warning.
    pub(super) fn firewall(&self) -> Finding {
        const CHECK: &str = "firewall";
        let mut all = FIREWALLS.iter();
        let active = all.find(|(_, file, says, _)| {
            let says = |text: String| {
                let mut lines = text.lines().map(str::trim);
                says.is_empty() || lines.any(|line| !line.starts_with('#') && line.contains(says))
            };
            self.text(file).is_some_and(says)
        });
        match active {
            None => Finding::ok(CHECK, "none of ufw, firewalld and nftables is set up"),
            Some((name, _, _, fix)) => {
                let found = format!(
                    "{name} is on: if it drops the UDP ports {PORTS}, other machines do not see components over DDS and ROS 2"
                );
                Finding::warning(CHECK, found, *fix)
            }
        }
    }

    /// A clock that steps after the boot, as that of a computer without a battery, gives messages of one
    /// run times that are years apart.
    pub(super) fn clock_steps(&self) -> Finding {
        const CHECK: &str = "clock steps";
        let Some(step) = self.step() else {
            return Finding::ok(CHECK, "the system does not show whether the clock stepped");
        };
        if step <= STEP {
            return Finding::ok(CHECK, "the clock has not stepped since the boot");
        }
        let found = format!("the clock has stepped by {step} s since the boot");
        let fix = "systemctl enable systemd-time-wait-sync, so that services start after it; or a clock with a battery";
        Finding::warning(CHECK, found, fix)
    }

    /// By how many seconds the clock has been set forward since the boot: /run was empty at the boot, so
    /// its oldest file has the time that the clock had then.
    fn step(&self) -> Option<i64> {
        let mounts = self.text("/proc/mounts")?;
        let is_run = |line: &str| {
            let mut words = line.split(' ').skip(1);
            words.next() == Some("/run") && words.next() == Some("tmpfs")
        };
        // In a container, /run may be a part of its image.
        mounts.lines().find(|line| is_run(line))?;
        let uptime = self.text("/proc/uptime")?;
        let uptime: f64 = uptime.split(' ').next()?.parse().ok()?;
        let now = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
        let boot = (now.as_secs_f64() - uptime) as i64;
        let files = std::fs::read_dir(self.path("/run")).ok()?.flatten();
        let oldest = files
            .filter_map(|file| Some(file.metadata().ok()?.mtime()))
            .min()?;
        Some(boot - oldest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Grade;
    use super::super::machine::tests::{is, with};
    use std::fs::File;
    use std::time::{Duration, SystemTime};

    #[test]
    fn a_firewall_is_named_with_the_rule_that_dds_needs() {
        with(
            &[("etc/ufw/ufw.conf", "# x\nENABLED=no\n")],
            &[],
            |machine| {
                is(&machine.firewall(), Grade::Ok, "none of ufw");
            },
        );
        with(&[("etc/ufw/ufw.conf", "ENABLED=yes\n")], &[], |machine| {
            is(
                &machine.firewall(),
                Grade::Warning,
                "fix: ufw allow proto udp",
            );
        });
        with(&[("run/firewalld.pid", "7")], &[], |machine| {
            is(
                &machine.firewall(),
                Grade::Warning,
                "--add-port=7400-9900/udp",
            );
        });
        let rules = "table inet filter {\n  # policy drop\n  chain input { policy accept; }\n}\n";
        with(&[("etc/nftables.conf", rules)], &[], |machine| {
            is(&machine.firewall(), Grade::Ok, "none of ufw");
        });
    }

    #[test]
    fn a_clock_that_was_set_forward_is_found_by_the_oldest_file_of_run() {
        let mounts = ("proc/mounts", "tmpfs /run tmpfs rw 0 0\n");
        let files = [mounts, ("proc/uptime", "100.5 7.0\n"), ("run/first", "")];
        let at = |ago: u64, grade, words: &str| {
            with(&files, &[], |machine| {
                let first = File::options().write(true).open(machine.path("/run/first"));
                let time = SystemTime::now() - Duration::from_secs(ago);
                first
                    .and_then(|file| file.set_modified(time))
                    .expect("a time");
                is(&machine.clock_steps(), grade, words);
            });
        };
        at(100, Grade::Ok, "not stepped");
        at(3700, Grade::Warning, "stepped by 3");
        with(&files[1..], &[], |machine| {
            is(&machine.clock_steps(), Grade::Ok, "does not show");
        });
    }
}
