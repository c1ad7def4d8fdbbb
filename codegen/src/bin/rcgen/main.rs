//! `rcgen`: from description files to a component.
//!
//! Exit codes: 0 done; 1 the input is wrong, or generated code is not up to date; 2 wrong usage; 3
//! the system refused.

mod generation;

use clap::{Args, Parser, Subcommand};
use rc_cdsl::model::Backend;
use rc_codegen::files::Change;
use rc_codegen::languages::Language;
use rc_codegen::view::BACKENDS;
use rc_codegen::{
    FileLoader, Files, Project, configuration, export, generate, languages, stubs, workspace,
};
use rc_diagnostics::{Diagnostics, Format, Severity, SourceMap, render};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Generates components from their .cdsl files: a generic layer that is rewritten, and a worker
/// that is yours.
#[derive(Parser)]
#[command(
    name = "rcgen",
    version,
    args_conflicts_with_subcommands = true,
    arg_required_else_help = true
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    generate: Generate,
}

/// The project that this program was built from.
const HERE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

#[derive(Subcommand)]
enum Command {
    /// Makes a workspace for components.
    Init {
        /// The folder of the workspace.
        dir: PathBuf,
        /// Where the framework's crates come from: a folder with this project, or a git address.
        #[arg(long, value_name = "PATH|GIT", default_value = HERE)]
        framework: String,
    },
    /// Makes an empty component in the workspace of the current folder.
    New {
        /// Its name.
        name: String,
    },
    /// Checks description files and configurations; reports all findings at once.
    Check {
        /// .idsl, .cdsl, .pdsl, .smdsl, .scxml, .ddsl files, .toml files that lie in a component's
        /// etc/, and folders with any of them.
        #[arg(required = true)]
        files: Vec<PathBuf>,
        #[command(flatten)]
        common: Common,
    },
    /// Formats description files. Comments stay; a file with a syntax error stays as it is.
    Fmt {
        /// Files, and folders that hold them (`target` and `generated` are left out).
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Lists the files that are not formatted, fails with 1 if there is one, and writes nothing.
        #[arg(long)]
        check: bool,
        /// How findings are printed: human, short or json (one object a line).
        #[arg(long, default_value = "human", value_parser = |text: &str| text.parse::<Format>())]
        format: Format,
    },
    /// Brings the configuration of a component to what its .pdsl declares now.
    Config {
        /// Adds new parameters with comment and default, turns removed ones into comments, and
        /// renames a value if the rename is certain. All else stays as it is.
        #[arg(long, required = true)]
        update: bool,
        /// The component, whose etc/config.toml is meant, or a .toml file in a component's etc/.
        #[arg(value_name = "FILE.cdsl|FILE.toml")]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// Lists what would change, and writes nothing.
        #[arg(long)]
        dry_run: bool,
        /// Fails with 1 if something would change, and writes nothing.
        #[arg(long)]
        check: bool,
    },
    /// Explains a diagnostic code with a wrong and a right example. Lists all codes without one.
    Explain {
        /// The code, such as unknown-type.
        code: Option<String>,
    },
    /// Writes interfaces, with all that they import, in the language of another middleware.
    Export {
        /// The interfaces: a file, or the name of one in an -I folder or of those that come with
        /// rcgen.
        #[arg(value_name = "FILE.idsl")]
        file: PathBuf,
        /// What to write: dds (OMG IDL 4.2), ros2 (interface packages).
        #[arg(long, value_name = "FORMAT", value_parser = target)]
        to: Target,
        /// The folder that the files are written to.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        #[command(flatten)]
        common: Common,
        /// Lists what would be written, and writes nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// Prints the handlers that src/ still lacks, ready to paste; writes nothing.
    Stubs {
        /// The component.
        #[arg(value_name = "FILE.cdsl")]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// The component's folder [default: the folder of FILE].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Prints a component as JSON, neutral of the language that is generated: for other generators.
    View {
        /// The component.
        #[arg(value_name = "FILE.cdsl")]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// The middleware of every slot that does not choose one.
        #[arg(long, value_name = "NAME", value_parser = middleware, default_value = "iceoryx2")]
        middleware: Backend,
    },
}

#[derive(Args)]
struct Generate {
    /// Components, and folders with components of a workspace. For the folder of the workspace
    /// itself, the crate `interfaces` then holds exactly what components use and what the folder of
    /// interfaces holds.
    #[arg(value_name = "FILE.cdsl|FOLDER")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// The component's folder [default: the folder of FILE].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The middleware of all slots that do not choose one: iceoryx2, dds or ros2; local for tests
    /// [default: iceoryx2; in a FOLDER, the middleware that a component was generated for before].
    #[arg(long, value_parser = middleware)]
    middleware: Option<Backend>,
    /// Generates this language, whatever the file says.
    #[arg(long, value_parser = ["rust"])]
    language: Option<String>,
    /// Lists what would be written, and writes nothing.
    #[arg(long)]
    dry_run: bool,
    /// Fails with 1 if generated/ is not what would be written, and writes nothing.
    #[arg(long)]
    check: bool,
}

#[derive(Args)]
struct Common {
    /// Looks for imported files here, too.
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
    /// How findings are printed: human, short or json (one object a line).
    #[arg(long, default_value = "human", value_parser = |text: &str| text.parse::<Format>())]
    format: Format,
}

fn middleware(text: &str) -> Result<Backend, String> {
    let found = BACKENDS.into_iter().find(|b| b.word() == text);
    found.ok_or_else(|| {
        let words = BACKENDS.map(Backend::word);
        let near = rc_diagnostics::nearest(text, words);
        near.map_or("there are iceoryx2, dds, ros2 and local".to_owned(), |n| {
            format!("did you mean `{n}`?")
        })
    })
}

/// What interfaces are exported to.
#[derive(Clone, Copy)]
enum Target {
    Dds,
    Ros2,
}

fn target(text: &str) -> Result<Target, String> {
    match text {
        "dds" => Ok(Target::Dds),
        "ros2" => Ok(Target::Ros2),
        "slice" => Err(format!(
            "{text} comes with a later version; there are dds and ros2"
        )),
        _ => {
            let near = rc_diagnostics::nearest(text, ["dds", "ros2", "slice"]);
            let hint = near.map(|near| format!("did you mean `{near}`?"));
            Err(hint.unwrap_or_else(|| "there are dds and ros2".to_owned()))
        }
    }
}

/// How a run ended, other than well.
enum Failure {
    /// The input is wrong, and has been told so.
    Input,
    /// The command line is wrong.
    Usage(String),
    /// The system refused.
    System(String),
}

/// Prints a line; a reader that has left is no failure.
fn print_line(line: std::fmt::Arguments<'_>) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Tells a person; a reader that has left is no failure.
fn tell(text: std::fmt::Arguments<'_>) {
    let _ = std::io::stderr().write_fmt(text);
}

/// Prints a text that ends its last line itself.
fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match cli.command {
        Some(Command::Init { dir, framework }) => init(&dir, &framework),
        Some(Command::New { name }) => new(&name),
        Some(Command::Check { files, common }) => check(&files, &common),
        Some(Command::Fmt {
            files,
            check,
            format,
        }) => fmt(&files, check, format),
        Some(Command::Config {
            update: _,
            file,
            common,
            dry_run,
            check,
        }) => update_configuration(&file, &common, dry_run, check),
        Some(Command::Explain { code }) => explain(code.as_deref()),
        Some(Command::Export {
            file,
            to,
            out,
            common,
            dry_run,
        }) => export_to(to, &file, &out, &common, dry_run),
        Some(Command::Stubs { file, common, out }) => print_stubs(&file, &common, out),
        Some(Command::View {
            file,
            common,
            middleware,
        }) => print_view(&file, &common, middleware),
        None => generation::run(&cli.generate),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Input) => ExitCode::from(1),
        Err(Failure::Usage(message)) => {
            tell(format_args!("rcgen: error: {message}\n"));
            ExitCode::from(2)
        }
        Err(Failure::System(message)) => {
            tell(format_args!("rcgen: error: {message}\n"));
            ExitCode::from(3)
        }
    }
}

fn explain(code: Option<&str>) -> Result<(), Failure> {
    let pages = rc_codegen::explain::pages();
    let Some(code) = code else {
        pages
            .iter()
            .for_each(|page| print_line(format_args!("{}", page.code)));
        return Ok(());
    };
    if let Some(page) = pages.iter().find(|page| page.code == code) {
        print_line(format_args!("{}\n\n{}", page.code, page.text));
        return Ok(());
    }
    let near = rc_diagnostics::nearest(code, pages.iter().map(|page| page.code));
    let hint = near.map_or("`rcgen explain` lists all codes".to_owned(), |near| {
        format!("did you mean `{near}`?")
    });
    Err(Failure::Usage(format!("there is no code `{code}`; {hint}")))
}

fn init(dir: &Path, framework: &str) -> Result<(), Failure> {
    let framework = workspace::Framework::parse(framework).map_err(Failure::Usage)?;
    if dir.join("Cargo.toml").exists() {
        return Err(Failure::Usage(format!(
            "{} has a Cargo.toml already",
            dir.display()
        )));
    }
    let files = workspace::init(&framework).map_err(|e| Failure::System(e.to_string()))?;
    write_new(&files, dir)
}

fn new(name: &str) -> Result<(), Failure> {
    let files = workspace::new_component(name).map_err(Failure::Usage)?;
    if Path::new("components").join(name).exists() {
        return Err(Failure::Usage(format!("components/{name} exists already")));
    }
    write_new(&files, Path::new("."))
}

fn write_new(files: &Files, folder: &Path) -> Result<(), Failure> {
    let steps = files
        .write(folder)
        .map_err(|e| Failure::System(e.to_string()))?;
    for step in steps.iter().filter(|s| s.change == Change::Create) {
        print_line(format_args!("create {}", folder.join(&step.path).display()));
    }
    Ok(())
}

fn check(files: &[PathBuf], common: &Common) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let mut found = Diagnostics::new();
    let loader = FileLoader::new(&common.include);
    let mut refused = None;
    let system = |e: std::io::Error| Failure::System(e.to_string());
    for file in rc_codegen::check::files(files, &mut sources, &mut found).map_err(system)? {
        if let Err(error) = rc_codegen::check::file(&file, &mut sources, &loader, &mut found) {
            unreadable(&file, &error, &mut sources, &mut found, &mut refused);
        }
    }
    let told = report(&sources, &found, common.format);
    refused.map_or(told, |why| Err(Failure::System(why)))
}

fn fmt(paths: &[PathBuf], check: bool, format: Format) -> Result<(), Failure> {
    let system = |e: std::io::Error| Failure::System(e.to_string());
    let mut sources = SourceMap::new();
    let mut found = Diagnostics::new();
    let mut refused = None;
    let mut differs = false;
    let formatted = |path: &Path| Language::of(path).is_some();
    let files = languages::files(paths, &formatted).map_err(system)?;
    if files.is_empty() {
        return Err(Failure::Usage("there is nothing to format".to_owned()));
    }
    for file in files {
        match rc_codegen::format::file(&file, check, &mut sources, &mut found) {
            Ok(false) => {}
            Ok(true) => {
                differs = true;
                let word = if check { "not formatted:" } else { "format" };
                print_line(format_args!("{word} {}", file.display()));
            }
            Err(error) => unreadable(&file, &error, &mut sources, &mut found, &mut refused),
        }
    }
    let told = report(&sources, &found, format);
    match refused {
        Some(why) => Err(Failure::System(why)),
        None if check && differs => Err(Failure::Input),
        None => told,
    }
}

fn update_configuration(
    file: &Path,
    common: &Common,
    dry_run: bool,
    check: bool,
) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (mut found, mut refused) = (Diagnostics::new(), None);
    let loader = FileLoader::new(&common.include);
    let updated = match configuration::update(file, &mut sources, &loader, &mut found) {
        Ok(updated) => updated,
        Err(error) => {
            unreadable(file, &error, &mut sources, &mut found, &mut refused);
            None
        }
    };
    if let Some(why) = refused {
        return Err(Failure::System(why));
    }
    report(&sources, &found, common.format)?;
    let Some(updated) = updated else {
        return Err(Failure::Input);
    };
    let path = updated.path.display();
    for change in &updated.update.changes {
        print_line(format_args!("{path}: {change}"));
    }
    if check && updated.differs() {
        tell(format_args!(
            "{path} is not up to date: rcgen config --update {path}\n"
        ));
        return Err(Failure::Input);
    }
    if !dry_run && !check {
        updated
            .write()
            .map_err(|e| Failure::System(format!("{path}: {e}")))?;
        let changes = updated.update.changes.iter();
        let gone = changes
            .filter(|change| matches!(change.kind, rc_configuration::ChangeKind::Removed(_)));
        match gone.count() {
            0 => {}
            1 => tell(format_args!("{path}: 1 value has become a comment\n")),
            gone => tell(format_args!("{path}: {gone} values have become comments\n")),
        }
    }
    if updated
        .update
        .changes
        .iter()
        .any(rc_configuration::Change::needs_decision)
    {
        tell(format_args!(
            "{path}: what is left to you stays an error; put it right, then: rcgen config --update {path}\n"
        ));
        return Err(Failure::Input);
    }
    Ok(())
}

/// A file that is no text is wrong input; anything else is the system's refusal.
fn unreadable(
    file: &Path,
    error: &std::io::Error,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
    refused: &mut Option<String>,
) {
    let bytes = (error.kind() == std::io::ErrorKind::InvalidData).then(|| std::fs::read(file));
    if let Some(Ok(bytes)) = bytes {
        found.push(rc_codegen::load::not_utf8(file, &bytes, sources));
    } else {
        let why = format!("{}: {error}", file.display());
        *refused = Some(match refused.take() {
            Some(before) => format!("{before}; {why}"),
            None => why,
        });
    }
}

/// Prints findings; an error among them is a failure.
fn report(sources: &SourceMap, found: &Diagnostics, format: Format) -> Result<(), Failure> {
    tell(format_args!("{}", render(sources, found, format)));
    let sorted = found.sorted();
    let error = sorted.iter().find(|d| d.severity == Severity::Error);
    let Some(error) = error else { return Ok(()) };
    if format == Format::Human {
        tell(format_args!("`rcgen explain {}` tells more\n", error.code));
    }
    Err(Failure::Input)
}

/// Reads a component; an error among the findings is reported, and ends the run.
fn load(
    file: &Path,
    common: &Common,
    sources: &mut SourceMap,
) -> Result<(Project, Diagnostics), Failure> {
    let loader = FileLoader::new(&common.include);
    let mut found = Diagnostics::new();
    if let Some(project) = try_load(file, &loader, sources, &mut found)? {
        return Ok((project, found));
    }
    report(sources, &found, common.format)?;
    Err(Failure::Input)
}

/// Reads a component; none where one of the findings that it adds is an error.
fn try_load(
    file: &Path,
    loader: &FileLoader,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Result<Option<Project>, Failure> {
    if file.extension().is_none_or(|e| e != "cdsl") {
        return Err(Failure::Usage(format!(
            "{} is not a .cdsl file",
            file.display()
        )));
    }
    match Project::load(file, sources, loader) {
        Ok((project, more)) => {
            let project = project.filter(|_| !more.has_errors());
            found.extend(more);
            Ok(project)
        }
        Err(error) => {
            let mut refused = None;
            unreadable(file, &error, sources, found, &mut refused);
            refused.map_or(Ok(None), |why| Err(Failure::System(why)))
        }
    }
}

fn export_to(
    target: Target,
    file: &Path,
    out: &Path,
    common: &Common,
    dry_run: bool,
) -> Result<(), Failure> {
    if file.extension().is_none_or(|e| e != "idsl") {
        let message = format!("{} is not an .idsl file", file.display());
        return Err(Failure::Usage(message));
    }
    let mut sources = SourceMap::new();
    let (mut found, mut refused) = (Diagnostics::new(), None);
    let loader = FileLoader::new(&common.include);
    let files = match export::load(file, &mut sources, &loader) {
        Ok((library, more)) => {
            found.extend(more);
            let right = Some(library).filter(|_| !found.has_errors());
            right.map(|library| {
                let (files, more) = match target {
                    Target::Dds => export::dds(&library, &sources),
                    Target::Ros2 => export::ros2(&library, &sources),
                };
                found.extend(more);
                files
            })
        }
        Err(error) => {
            unreadable(file, &error, &mut sources, &mut found, &mut refused);
            None
        }
    };
    if let Some(why) = refused {
        return Err(Failure::System(why));
    }
    report(&sources, &found, common.format)?;
    let Some(files) = files else {
        return Err(Failure::Input);
    };
    if files.iter().next().is_none() {
        let file = file.display();
        tell(format_args!("{file}: there is nothing to export in it\n"));
    }
    let system = |e: std::io::Error| Failure::System(e.to_string());
    let steps = files.plan(out).map_err(system)?;
    if let Some(foreign) =
        export::first_foreign_file(&steps, out, export::HEADER).map_err(system)?
    {
        return Err(Failure::Usage(format!(
            "{} is there, and was not written by an export; name another folder",
            foreign.display()
        )));
    }
    if !dry_run {
        files.write(out).map_err(system)?;
    }
    for step in steps.iter().filter(|s| s.change != Change::Keep) {
        let path = out.join(&step.path);
        print_line(format_args!("{} {}", step.change.word(), path.display()));
    }
    Ok(())
}

fn print_view(file: &Path, common: &Common, middleware: Backend) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (mut project, mut found) = load(file, common, &mut sources)?;
    // The view is the same for every language.
    "rust".clone_into(&mut project.component.language.text);
    let (json, more) =
        generate::view(&project, middleware).map_err(|e| Failure::System(e.to_string()))?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    print(&json);
    Ok(())
}

fn print_stubs(file: &Path, common: &Common, out: Option<PathBuf>) -> Result<(), Failure> {
    let mut sources = SourceMap::new();
    let (mut project, mut found) = load(file, common, &mut sources)?;
    // Whatever the file says: the handlers that are there are Rust.
    "rust".clone_into(&mut project.component.language.text);
    let system = |e: stubs::Error| Failure::System(e.to_string());
    let folder = out.unwrap_or_else(|| project.folder().to_path_buf());
    let (missing, more) = stubs::of(&project, &folder, &mut sources).map_err(system)?;
    found.extend(more);
    report(&sources, &found, common.format)?;
    let Some(missing) = missing else {
        return Err(Failure::Input);
    };
    if !missing.is_empty() {
        print(&missing.text().map_err(system)?);
    } else if common.format != Format::Json {
        tell(format_args!(
            "{}: nothing is missing; handlers: {}\n",
            file.display(),
            missing.total()
        ));
    }
    Ok(())
}
