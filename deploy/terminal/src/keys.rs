//! Handles keys.

use super::input::Key;
use super::model::{Command, Host, Model, Page, Prompt};
use super::rows::Kind;
use rc_deploy_client::params;
use rc_management::supervisor::ComponentState;
use rc_management::supervisor::Verb;

/// The keys on the help page.
pub(crate) const HELP: [(&str, &str); 16] = [
    ("up down", "another component"),
    ("enter", "its log; folds and unfolds a group"),
    ("l p c", "its log, parameters, connections"),
    ("tab", "the next of these pages"),
    ("esc", "back to all components"),
    ("left right", "folds, unfolds"),
    ("page up/down", "scrolls events, log, lists"),
    ("home end", "the first, the last"),
    ("r", "restarts the component or the group"),
    ("x", "stops it"),
    ("s", "starts it"),
    ("e", "emergency, at once; again to leave it"),
    ("E", "emergency of all components, at once"),
    ("enter, w", "parameters: changes one, saves all"),
    ("ctrl+l", "redraws the screen"),
    ("q, ctrl+c", ""),
];

/// Help text of the key that leaves the view.
pub(crate) fn leaving(host: Host) -> &'static str {
    match host {
        Host::Up => "q asks, ctrl+c does not: stop the network; again kills",
        Host::Top => "leaves; the network goes on",
    }
}

impl Model {
    /// Handles a key. Returns a command for the session.
    pub(crate) fn key(&mut self, key: Key) -> Option<Command> {
        if key == Key::Control('c') {
            self.prompt = None;
            return Some(Command::Quit { interrupt: true });
        }
        self.notice = None;
        match self.prompt.take() {
            Some(Prompt::Confirm { question, command }) => match key {
                Key::Char('y' | 'Y') => Some(command),
                Key::Char('n' | 'N') | Key::Esc => None,
                // Another key: the question stays.
                _ => {
                    self.prompt = Some(Prompt::Confirm { question, command });
                    None
                }
            },
            Some(edit @ Prompt::Edit { .. }) => self.edit(edit, key),
            None => self.command(key),
        }
    }

    fn edit(&mut self, mut prompt: Prompt, key: Key) -> Option<Command> {
        let Prompt::Edit {
            path,
            text,
            is_text,
            is_old,
            ..
        } = &mut prompt
        else {
            return None;
        };
        match key {
            Key::Esc => return None,
            Key::Enter => {
                let value = if *is_text && !text.starts_with(['"', '\'']) {
                    text.as_str().into()
                } else {
                    rc_configuration::parse_argument(text)
                };
                return Some(Command::Set {
                    name: self.selected.clone(),
                    path: path.clone(),
                    value,
                });
            }
            // Typed text replaces the old value. Other keys keep it for editing.
            Key::Char(letter) if *is_old => *text = letter.to_string(),
            Key::Char(letter) => text.push(letter),
            Key::Backspace => drop(text.pop()),
            Key::Control('u') => text.clear(),
            _ => {}
        }
        *is_old = false;
        self.prompt = Some(prompt);
        None
    }

    fn command(&mut self, key: Key) -> Option<Command> {
        match key {
            Key::Char('q') => {
                let question = format!("stop the network {}?", self.network);
                let quit = Command::Quit { interrupt: false };
                return self.asked(self.host == Host::Up && !self.stopping, question, quit);
            }
            Key::Control('l') => return Some(Command::Redraw),
            Key::Char('?') if self.page == Page::Help => self.turn_to(Page::Table),
            Key::Char('?') => self.turn_to(Page::Help),
            Key::Esc | Key::Backspace => self.turn_to(Page::Table),
            Key::Char('l') => self.turn_to_component(Page::Log),
            Key::Char('p') => self.turn_to_component(Page::Parameters),
            Key::Char('c') => self.turn_to_component(Page::Connections),
            Key::Tab | Key::BackTab => self.next_page(key == Key::Tab),
            Key::Char('r') => return self.control(Verb::Restart),
            Key::Char('x') => return self.control(Verb::Stop),
            Key::Char('s') => return self.control(Verb::Start),
            Key::Char('e') => return self.emergency(false),
            Key::Char('E') => return self.emergency(true),
            Key::Char('w') if self.page == Page::Parameters => {
                return Some(Command::Save {
                    name: self.selected.clone(),
                });
            }
            Key::Enter => self.enter(),
            Key::Left | Key::Char('h') if self.page == Page::Table => self.fold(true),
            Key::Right if self.page == Page::Table => self.fold(false),
            Key::Char(' ') if self.page == Page::Table => self.toggle(),
            Key::Up | Key::Char('k') => self.go(-1),
            Key::Down | Key::Char('j') => self.go(1),
            Key::PageUp => self.leaf(-1),
            Key::PageDown => self.leaf(1),
            Key::Home => self.go(isize::MIN),
            Key::End => self.go(isize::MAX),
            _ => {}
        }
        None
    }

    fn turn_to(&mut self, page: Page) {
        if self.page != page {
            self.page = page;
            self.line = 0;
            self.log.clear();
            self.parameters = None;
        }
    }

    fn turn_to_component(&mut self, page: Page) {
        if self.component().is_some() {
            self.turn_to(page);
        } else {
            self.say("choose a component, not a group", true);
        }
    }

    fn next_page(&mut self, forwards: bool) {
        let pages = [Page::Log, Page::Parameters, Page::Connections];
        let at = pages.iter().position(|page| *page == self.page);
        let next = match (at, forwards) {
            (None, _) => 0,
            (Some(at), true) => (at + 1) % pages.len(),
            (Some(at), false) => (at + pages.len() - 1) % pages.len(),
        };
        self.turn_to_component(pages[next]);
    }

    fn enter(&mut self) {
        match self.page {
            Page::Table if self.component().is_some() => self.turn_to(Page::Log),
            Page::Table => self.toggle(),
            Page::Help => self.turn_to(Page::Table),
            Page::Parameters => self.begin_edit(),
            Page::Log | Page::Connections => {}
        }
    }

    fn begin_edit(&mut self) {
        let Some(Ok(known)) = &self.parameters else {
            return;
        };
        let Some(parameter) = known.parameters.get(self.line) else {
            return;
        };
        if !parameter.editable && !parameter.restart {
            let text = format!("`{}` is fixed while the component runs", parameter.path);
            self.say(text, true);
            return;
        }
        let is_text = parameter.is_text();
        let text = match (&parameter.pending, &parameter.value) {
            _ if parameter.secret => String::new(),
            (Some(value), _) | (None, value) => match value.as_str() {
                Some(text) if is_text => text.to_owned(),
                _ => params::text(value),
            },
        };
        self.prompt = Some(Prompt::Edit {
            path: parameter.path.clone(),
            text,
            is_text,
            is_old: true,
            secret: parameter.secret,
        });
    }

    fn fold(&mut self, fold: bool) {
        let rows = self.rows();
        let Some(row) = rows.iter().find(|row| row.path == self.selected) else {
            return;
        };
        let is_open = row.kind == Kind::Group { folded: false };
        if is_open && fold {
            self.folded.insert(self.selected.clone());
        } else if !fold {
            self.folded.remove(&self.selected);
        } else if let Some((group, _)) = self.selected.rsplit_once('.') {
            self.selected = group.to_owned();
        }
    }

    fn toggle(&mut self) {
        let folded = self.folded.contains(&self.selected);
        if self.component().is_none() {
            self.fold(!folded);
        }
    }

    /// One line up or down, or to the end.
    fn go(&mut self, by: isize) {
        match self.page {
            Page::Table => {
                let rows = self.rows();
                let at = rows.iter().position(|row| row.path == self.selected);
                let to = at.unwrap_or(0).saturating_add_signed(by);
                let to = rows.get(to).or(rows.last());
                if let Some(path) = to.map(|row| row.path.to_owned()) {
                    self.selected = path;
                }
            }
            // Lines of a log count from its end.
            Page::Log => self.scroll(by.saturating_neg()),
            Page::Parameters | Page::Connections => self.scroll(by),
            Page::Help => {}
        }
    }

    /// About as many lines as the screen has.
    fn leaf(&mut self, direction: isize) {
        let lines = isize::from(self.size.1.min(1000) as i16).max(8) / 2 * direction;
        match self.page {
            Page::Table => {
                let all: usize = self.events.iter().map(|e| e.message.lines().count()).sum();
                let to = self.events_scroll.saturating_add_signed(-lines / 2);
                self.events_scroll = to.min(all.saturating_sub(1));
            }
            Page::Log | Page::Parameters | Page::Connections | Page::Help => self.go(lines),
        }
    }

    fn scroll(&mut self, by: isize) {
        let count = match self.page {
            Page::Log => self.log.len(),
            Page::Parameters => match &self.parameters {
                Some(Ok(known)) => known.parameters.len(),
                _ => 0,
            },
            Page::Connections => {
                let report = self.component().and_then(|c| c.report.as_ref());
                report.map_or(0, |report| report.slots.len() * 2)
            }
            Page::Table | Page::Help => 0,
        };
        let to = self.line.saturating_add_signed(by);
        self.line = to.min(count.saturating_sub(1));
    }

    /// Commands that stop something ask first.
    fn control(&mut self, verb: Verb) -> Option<Command> {
        let count = self.chosen().len();
        if count == 0 {
            return None;
        }
        let question = format!("{} {}?", verb.word(), self.what(count));
        let name = self.selected.clone();
        self.asked(
            verb != Verb::Start,
            question,
            Command::Control { verb, name },
        )
    }

    /// Enters the emergency state at once, and asks before it ends the state.
    fn emergency(&mut self, all: bool) -> Option<Command> {
        let chosen = if all {
            self.components.iter().collect()
        } else {
            self.chosen()
        };
        let running: Vec<(String, ComponentState)> = chosen
            .iter()
            .filter(|c| c.status.pid.is_some())
            .map(|c| (c.status.name.clone(), c.status.state))
            .collect();
        if running.is_empty() {
            self.say("nothing runs there", true);
            return None;
        }
        let active = !running
            .iter()
            .all(|(_, state)| *state == ComponentState::Emergency);
        let names: Vec<String> = running.into_iter().map(|(name, _)| name).collect();
        let what = if all {
            "all components".to_owned()
        } else {
            self.what(names.len())
        };
        let question = format!("end the emergency of {what}?");
        self.asked(!active, question, Command::Emergency { names, active })
    }

    fn asked(&mut self, ask: bool, question: String, command: Command) -> Option<Command> {
        if !ask {
            return Some(command);
        }
        self.prompt = Some(Prompt::Confirm { question, command });
        None
    }

    /// The subject of a command, for people.
    fn what(&self, count: usize) -> String {
        match (self.component(), count) {
            (Some(_), _) => self.selected.clone(),
            (None, 1) => format!("the one component of {}", self.selected),
            (None, count) => format!("the {count} components of {}", self.selected),
        }
    }
}
