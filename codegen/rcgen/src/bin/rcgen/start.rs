//! `rcgen init` and `rcgen new`.

use crate::command_line::{Common, Generate, New};
use crate::generation;
use crate::reports::{Failure, print_line, system, tell};
use rc_cdsl::model::Role;
use rc_codegen::cargo_workspace::Workspace;
use rc_codegen::files::Change;
use rc_codegen::new_component::{self, NewComponent};
use rc_codegen::paths::{absolute, relative};
use rc_codegen::{FileLoader, Files, from_robocomp, names, workspace};
use rc_vocabulary::Language;
use std::path::Path;

pub(crate) fn init(dir: &Path, framework: &str, shared_target: bool) -> Result<(), Failure> {
    let root = absolute(dir).map_err(system)?;
    let framework = workspace::Framework::parse(framework).map_err(Failure::Usage)?;
    let framework = framework.seen_from(&root);
    if dir.join("Cargo.toml").exists() {
        return Err(Failure::Usage(format!(
            "{} has a Cargo.toml already",
            dir.display()
        )));
    }
    let parent = root.parent().unwrap_or(&root);
    if let Ok(Some(around)) = Workspace::of(parent) {
        return Err(Failure::Usage(format!(
            "{} would be inside the workspace {}, whose components `rcgen new` makes; name a folder outside of it",
            dir.display(),
            around.root().display()
        )));
    }
    let network = root.file_name().unwrap_or_default().to_string_lossy();
    let network = match names::package(&network) {
        name if name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.is_ascii() => name,
        _ => "robot".to_owned(),
    };
    let mut files = workspace::init(&network, &framework).map_err(system)?;
    if shared_target {
        workspace::share_target(&mut files, &root, &framework).map_err(Failure::Usage)?;
    }
    write_new(&files, dir)?;
    if !framework.is_portable() {
        tell(format_args!(
            "note: the workspace builds on this machine only, since Cargo.toml names the framework by a path outside; \
             --framework also takes a git address, a version, or a folder inside the workspace"
        ));
    }
    Ok(())
}

pub(crate) fn new(args: New) -> Result<(), Failure> {
    let here = absolute(Path::new(".")).map_err(system)?;
    let workspace = new_component::workspace(&here).map_err(refused)?;
    let root = relative(&here, workspace.root());
    let slots = [
        (Role::Implements, args.implements),
        (Role::Requires, args.requires),
        (Role::Publishes, args.publishes),
        (Role::SubscribesTo, args.subscribes),
    ];
    let wanted = NewComponent {
        name: args.name,
        slots: slots
            .into_iter()
            .filter(|(_, interfaces)| !interfaces.is_empty())
            .collect(),
        period: args.period,
        language: match (args.language.as_deref(), &args.from) {
            (Some(word), _) => Language::from_word(word),
            (None, Some(from)) => NewComponent::language_of(from).map_err(refused)?,
            (None, None) => None,
        }
        .unwrap_or(Language::Rust),
        from: args.from,
    };
    let loader = FileLoader::new(&args.common.include);
    let files = wanted.files(&workspace, &loader).map_err(refused)?;
    let folder = root.join(wanted.folder());
    write_new(&files, &root)?;
    let cdsl = folder.join(format!("{}.cdsl", wanted.name));
    let generated = generation::run(&Generate {
        files: vec![cdsl],
        common: Common {
            include: args.common.include,
            format: args.common.format,
        },
        middleware: args.middleware,
        ..Generate::default()
    });
    if generated.is_err() {
        // Nothing is left of a component that cannot be generated.
        std::fs::remove_dir_all(&folder).map_err(system)?;
        tell(format_args!("{} was removed again", folder.display()));
        return generated;
    }
    let member = new_component::member(&workspace, &wanted).map_err(system)?;
    for step in member.write(workspace.root()).map_err(system)? {
        if step.change == Change::Update {
            print_line(format_args!("update {}", root.join(&step.path).display()));
        }
    }
    if let (Language::Cpp, Some(old)) = (wanted.language, &wanted.from) {
        for line in from_robocomp::gone(old).map_err(system)? {
            tell(format_args!("{line}"));
        }
    }
    let name = &wanted.name;
    print_line(format_args!(
        "in a network: Component {name} {{ cdsl \"../components/{name}/{name}.cdsl\"; }};"
    ));
    Ok(())
}

fn refused(error: new_component::Error) -> Failure {
    match error {
        new_component::Error::Refused(message) => Failure::Usage(message),
        new_component::Error::Io(error) => generation::manifest(error),
    }
}

fn write_new(files: &Files, folder: &Path) -> Result<(), Failure> {
    let steps = files.write(folder).map_err(system)?;
    for step in steps.iter().filter(|s| s.change == Change::Create) {
        print_line(format_args!("create {}", folder.join(&step.path).display()));
    }
    Ok(())
}
