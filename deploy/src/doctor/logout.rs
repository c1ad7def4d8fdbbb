//! What a logout ends and removes (logind.conf(5)): `KillUserProcesses=` ends the processes of the
//! login. When a user has no login any more, systemd ends the services of the user, unless the user
//! lingers, and `RemoveIPC=` removes the shared memory of the user. A login lasts as long as one of its
//! processes runs.

use super::{Finding, Machine};
use rc_vocabulary::shell;

/// What the logout of a user does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Logout {
    /// The name of the user.
    user: String,
    /// Whether services and shared memory of the user stay without a login.
    lingers: bool,
    /// Whether the processes of a login end with it.
    kills: bool,
    /// Whether this process is part of a login of the user.
    in_login: bool,
    /// Whether the user's manager of services can be reached from here.
    has_manager: bool,
}

impl Logout {
    /// The name of the user.
    pub(crate) fn user(&self) -> &str {
        &self.user
    }

    /// Whether a process that is started here lives on after the logout only as a scope of the user's
    /// manager.
    pub(crate) fn needs_scope(&self) -> bool {
        self.kills && self.in_login && self.lingers && self.has_manager
    }

    /// What happens to a network that is started here in the background, and how to prevent it. `None`
    /// if it lives on, with [`needs_scope`](Self::needs_scope) as a scope.
    pub(crate) fn ends(&self) -> Option<(String, String)> {
        if self.in_login && !self.kills || self.needs_scope() {
            return None;
        }
        if self.in_login && self.lingers {
            let advice = "to prevent it, start it where `systemctl --user` works".to_owned();
            return Some((self.found(), advice));
        }
        let advice = || format!("prevent it with `{}`", self.fix());
        (!self.lingers).then(|| (self.found(), advice()))
    }

    /// What happens to a service of systemd, or to one that runs as the user, and the command that prevents
    /// it.
    pub(crate) fn ends_service(&self) -> Option<(String, String)> {
        (!self.lingers).then(|| (self.found(), self.fix()))
    }

    fn found(&self) -> String {
        let user = &self.user;
        if self.kills {
            let also = if self.lingers {
                String::new()
            } else {
                format!(", and removes the shared memory of {user}")
            };
            format!(
                "when {user} logs out, systemd ends the networks that were started in the login{also}"
            )
        } else {
            format!(
                "when {user} has logged out, systemd ends the services of {user}, and removes the shared memory also of networks that run as {user}"
            )
        }
    }

    fn fix(&self) -> String {
        format!("loginctl enable-linger {}", shell::word(&self.user))
    }
}

impl Machine<'_> {
    /// The name of the user: that of /etc/passwd, else that of another name service, such as LDAP, else
    /// the number.
    pub(crate) fn user_name(&self) -> String {
        let number = self.user.to_string();
        if let Some((name, _)) = rc_middleware::user_name(self.user).split_once(' ') {
            return name.to_owned();
        }
        // A name service may be on another machine, which does not answer.
        let entry = self.said("timeout", &["3", "getent", "passwd", &number]);
        let name = entry.as_deref().and_then(|entry| entry.split(':').next());
        name.filter(|name| !name.is_empty())
            .map_or(number, str::to_owned)
    }

    /// What the logout of the user does. The error says why it does nothing.
    pub(crate) fn logout(&self) -> Result<Logout, &'static str> {
        if !self.path("/run/systemd/system").is_dir() {
            return Err("no systemd here: a logout removes nothing");
        }
        // Users of the system, and root, are left alone.
        if self.user < 1000 {
            return Err("systemd leaves users of the system alone");
        }
        let user = self.user_name();
        let own = format!("/user-{}.slice/session-", self.user);
        let groups = self.text("/proc/self/cgroup");
        let asked = [
            "--timeout=3",
            "get-property",
            "org.freedesktop.login1",
            "/org/freedesktop/login1",
            "org.freedesktop.login1.Manager",
            "KillUserProcesses",
        ];
        let manager = (self.variable)("XDG_RUNTIME_DIR")
            .map(|folder| self.path(&folder).join("systemd/private"));
        // As systemd escapes the name (`cescape`): those of Active Directory are `DOMAIN\name`.
        let linger = user.replace('\\', r"\\");
        Ok(Logout {
            lingers: self.path("/var/lib/systemd/linger").join(linger).exists(),
            kills: self.said("busctl", &asked).as_deref() == Some("b true"),
            in_login: groups.is_some_and(|groups| groups.contains(&own)),
            has_manager: manager.is_some_and(|socket| socket.exists()),
            user,
        })
    }

    pub(super) fn logout_finding(&self) -> Finding {
        const CHECK: &str = "logout";
        let logout = match self.logout() {
            Ok(logout) => logout,
            Err(why) => return Finding::ok(CHECK, why),
        };
        match logout.ends_service() {
            Some((found, fix)) => Finding::warning(CHECK, found, fix),
            None => Finding::ok(
                CHECK,
                format!("{} lingers: networks outlive a logout", logout.user),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Grade;
    use super::super::machine::tests::{is, with};
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    const SYSTEMD: (&str, &str) = ("run/systemd/system/", "");
    const LINGER: (&str, &str) = ("var/lib/systemd/linger/4000000", "");

    #[test]
    fn a_logout_removes_memory_unless_the_user_lingers() {
        with(&[SYSTEMD], &[], |machine| {
            is(
                &machine.logout_finding(),
                Grade::Warning,
                "loginctl enable-linger 4000000",
            );
        });
        with(&[SYSTEMD, LINGER], &[], |machine| {
            is(&machine.logout_finding(), Grade::Ok, "lingers");
        });
        with(&[], &[], |machine| {
            is(&machine.logout_finding(), Grade::Ok, "no systemd");
        });
    }

    /// What the logout does where systemd says this of the processes of a login.
    fn logout(kills: &str, groups: &str, more: &[(&str, &str)]) -> Logout {
        let said = format!("#!/bin/sh\necho b {kills}\n");
        let files = [SYSTEMD, ("proc/self/cgroup", groups), ("bin/busctl", &said)];
        with(&[&files, more].concat(), &[], |machine| {
            let folder = machine.path("bin");
            for program in folder.read_dir().expect("a folder") {
                let mode = PermissionsExt::from_mode(0o755);
                std::fs::set_permissions(program.expect("a file").path(), mode).expect("set");
            }
            let folder = folder.to_string_lossy().into_owned();
            let variable = |name: &str| match name {
                "PATH" => Some(format!("{folder}:/usr/bin:/bin")),
                "XDG_RUNTIME_DIR" => Some("/run/user/4000000".to_owned()),
                _ => None,
            };
            let machine = Machine {
                root: machine.root.clone(),
                variable: &variable,
                user: machine.user,
                folder: machine.folder.clone(),
            };
            machine.logout().expect("it does something")
        })
    }

    #[test]
    fn a_user_of_another_name_service_lingers_by_name() {
        for (name, file, word) in [
            ("mia", "mia", "mia"),
            (r"CORP\mia bell", r"CORP\\mia bell", r"'CORP\mia bell'"),
        ] {
            let entry = format!(
                "#!/bin/sh\n[ \"$*\" = 'passwd 4000000' ] && printf '%s\\n' '{name}:*:4000000:1:Mia:/home/mia:/bin/sh'\n"
            );
            let lingers = |more: &[(&str, &str)]| {
                let files = [&[("bin/getent", &*entry)], more].concat();
                logout("false", "", &files)
                    .ends_service()
                    .map(|(_, fix)| fix)
            };
            let file = format!("var/lib/systemd/linger/{file}");
            assert_eq!(lingers(&[(&file, "")]), None);
            let fix = Some(format!("loginctl enable-linger {word}"));
            assert_eq!(lingers(&[LINGER]), fix);
        }
    }

    #[test]
    fn a_network_in_the_background_outlives_its_login_where_that_is_allowed() {
        let login = "0::/user.slice/user-4000000.slice/session-3.scope\n";
        let other = "0::/user.slice/user-0.slice/session-3.scope\n";
        let service = "0::/user.slice/user-4000000.slice/user@4000000.service/app.slice\n";
        let manager = ("run/user/4000000/systemd/private", "");
        let advice = |logout: &Logout| logout.ends().map(|(_, advice)| advice);
        let linger = Some("prevent it with `loginctl enable-linger 4000000`".to_owned());

        // The processes keep their login open.
        let kept = logout("false", login, &[manager]);
        assert_eq!((kept.needs_scope(), advice(&kept)), (false, None));
        // It is ended with its login, even if the user lingers, unless it leaves the login.
        let ended = logout("true", login, &[manager]);
        assert_eq!(
            (ended.needs_scope(), advice(&ended)),
            (false, linger.clone())
        );
        let leaves = logout("true", login, &[manager, LINGER]);
        assert_eq!((leaves.needs_scope(), advice(&leaves)), (true, None));
        let stays = logout("true", login, &[LINGER]);
        assert!(!stays.needs_scope());
        let (found, advice_there) = stays.ends().expect("it ends");
        assert!(!found.contains("memory") && !advice_there.contains("linger"));
        // Without a login of the user, only lingering keeps the memory.
        for groups in [other, service] {
            let lost = logout("false", groups, &[manager]);
            assert_eq!((lost.needs_scope(), advice(&lost)), (false, linger.clone()));
            let kept = logout("true", groups, &[manager, LINGER]);
            assert_eq!((kept.needs_scope(), advice(&kept)), (false, None));
        }
    }
}
