//! Command lines as they stand in pages and in `--help`: every one is understood by the command line.

use super::blocks::{fenced, pages};
use super::reference::leaves;
use calib::cli;
use clap::error::ErrorKind;

/// Runs of a shell line up to what no command takes: pipes, redirections, comments, further commands.
fn words(line: &str) -> Vec<Vec<String>> {
    let mut commands = vec![Vec::new()];
    let (mut word, mut quote, mut open) = (String::new(), None, false);
    let mut letters = line.chars().peekable();
    let mut skip = false;
    while let Some(letter) = letters.next() {
        match (letter, quote) {
            (mark, Some(end)) if mark == end => quote = None,
            (other, Some(_)) => word.push(other),
            ('\'' | '"', None) => (quote, open) = (Some(letter), true),
            ('#', None) if word.is_empty() && !open => break,
            (' ' | '\n' | '|' | '>' | '<' | ';' | '&', None) => {
                if (!word.is_empty() || open) && !std::mem::take(&mut skip) {
                    commands
                        .last_mut()
                        .expect("one")
                        .push(std::mem::take(&mut word));
                }
                (word, open) = (String::new(), false);
                match letter {
                    '>' | '<' => skip = true,
                    '|' | ';' | '&' => commands.push(Vec::new()),
                    _ => (),
                }
            }
            ('\\', None) if letters.peek() == Some(&'\n') => (),
            (other, None) => word.push(other),
        }
    }
    if (!word.is_empty() || open) && !skip {
        commands.last_mut().expect("one").push(word);
    }
    commands
}

/// What is wrong with a line as a command of calib; nothing where it is none.
fn fault(line: &str, whole: bool) -> Option<String> {
    words(line).into_iter().find_map(|mut words| {
        if words.starts_with(&["cargo".into(), "run".into()]) {
            let ours = words.iter().position(|word| word == "--")?;
            words.drain(..=ours);
            words.insert(0, "calib".into());
        }
        if words.first().map(String::as_str) != Some("calib") {
            return None;
        }
        let kept: Vec<String> = words
            .into_iter()
            .filter(|word| word != "..." && word != "…")
            .collect();
        let error = cli::command().try_get_matches_from(&kept).err()?;
        let partial = [
            ErrorKind::MissingRequiredArgument,
            ErrorKind::MissingSubcommand,
            ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand,
        ];
        let help = [ErrorKind::DisplayHelp, ErrorKind::DisplayVersion].contains(&error.kind());
        (!help && (whole || !partial.contains(&error.kind())))
            .then(|| format!("{}: {error}", kept.join(" ")))
    })
}

/// Lines of a shell, those that go on in the next one together.
fn lines(block: &[&str]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for line in block {
        let unfinished = out
            .last()
            .is_some_and(|last| last.ends_with('\\') || last.matches('\'').count() % 2 == 1);
        match out.last_mut().filter(|_| unfinished) {
            Some(last) => *last = format!("{last}\n{line}"),
            None => out.push(line.to_string()),
        }
    }
    out
}

#[test]
fn command_lines_of_the_pages_are_understood() {
    let (mut faults, mut count) = (Vec::new(), 0);
    for (page, text) in pages() {
        for block in fenced(&text) {
            let typed: Vec<String> = match block.kind {
                "sh" => lines(&block.lines),
                "console" => {
                    let prompts = block
                        .lines
                        .iter()
                        .filter_map(|line| line.strip_prefix("$ ").or(line.strip_prefix("> ")));
                    lines(&prompts.collect::<Vec<_>>())
                }
                _ => continue,
            };
            count += typed.len();
            faults.extend(
                typed
                    .iter()
                    .filter_map(|line| Some(format!("{page}: {}", fault(line, true)?))),
            );
        }
        let prose: String = text.split("```").step_by(2).collect();
        for code in prose
            .split('`')
            .skip(1)
            .step_by(2)
            .filter(|code| code.starts_with("calib "))
        {
            count += 1;
            faults.extend(fault(code, false).map(|fault| format!("{page}: {fault}")));
        }
    }
    assert!(count > 80, "only {count} command lines");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn examples_of_the_help_are_understood() {
    let (mut faults, mut count) = (Vec::new(), 0);
    for (words, command) in leaves(&cli::command(), &[]) {
        let Some(after) = command.get_after_help().map(ToString::to_string) else {
            continue;
        };
        let Some((_, examples)) = after.split_once("Examples:") else {
            continue;
        };
        let typed: Vec<&str> = examples
            .lines()
            .skip(1)
            .take_while(|line| line.starts_with("  "))
            .map(str::trim)
            .collect();
        for line in lines(&typed) {
            count += 1;
            faults.extend(fault(&line, true).map(|fault| format!("{}: {fault}", words.join(" "))));
        }
    }
    assert!(count > 50, "only {count} examples");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_line_of_a_shell_is_split_as_a_shell_splits_it() {
    let is_ours = |line: &str| {
        words(line)
            .into_iter()
            .map(|words| words.join("|"))
            .collect::<Vec<_>>()
    };
    assert_eq!(
        is_ours("calib query HEAD 'SELECT a, b' > x.csv  # why"),
        ["calib|query|HEAD|SELECT a, b"]
    );
    assert_eq!(
        is_ours("calib tag HEAD released && calib verify"),
        ["calib|tag|HEAD|released", "", "calib|verify"]
    );
    assert!(fault("calib run pipeline.yaml --frce", true).is_some());
    assert!(fault("calib run", true).is_some() && fault("calib run", false).is_none());
    assert!(fault("calibrate --frce", true).is_none());
}
