//! The help of calib itself: its verbs in groups, by what one is about to do.

use clap::Command;

/// What one is about to do, and the verbs for it.
const GROUPS: &[(&str, &[&str])] = &[
    (
        "Calibrate a robot",
        &[
            "init",
            "check",
            "run",
            "diagnose",
            "compensate",
            "serve-model",
            "verify-robot",
            "export",
            "check-export",
        ],
    ),
    (
        "Look at what was computed",
        &[
            "show", "log", "diff", "explain", "query", "lineage", "schema",
        ],
    ),
    ("Plan a measurement", &["poses", "excite"]),
    ("Many robots", &["fleet"]),
    ("Keep the store", &["tag", "verify", "gc"]),
    ("Laboratory", &["simulate", "effects", "robots"]),
    ("Shell", &["completions", "man"]),
];

/// The command with its verbs in groups, each with the first clause of what it does.
pub(super) fn grouped(command: Command) -> Command {
    let width = command
        .get_subcommands()
        .map(|verb| verb.get_name().len())
        .max()
        .unwrap_or(0);
    let line = |verb: &&str| {
        let about = command
            .find_subcommand(verb)
            .and_then(Command::get_about)
            .map(ToString::to_string)
            .unwrap_or_default();
        let clause = about.split(": ").next().unwrap_or_default();
        format!("  {verb:width$}  {clause}\n")
    };
    let header = clap::builder::Styles::styled();
    let header = header.get_header();
    let group = |(what, verbs): &(&str, &[&str])| {
        format!(
            "{header}{what}:{header:#}\n{}\n",
            verbs.iter().map(line).collect::<String>()
        )
    };
    let groups: String = GROUPS.iter().map(group).collect();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}`calib VERB --help` says more of a verb.\n\n\
         {header}Options:{header:#}\n{{options}}{{after-help}}"
    );
    command.help_template(template)
}

#[cfg(test)]
mod tests {
    use super::GROUPS;
    use clap::CommandFactory;

    #[test]
    fn every_verb_stands_in_one_group() {
        let mut grouped: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, verbs)| verbs.iter().copied())
            .collect();
        grouped.sort_unstable();
        let command = crate::cli::Arguments::command();
        let mut verbs: Vec<&str> = command
            .get_subcommands()
            .map(clap::Command::get_name)
            .collect();
        verbs.sort_unstable();
        assert_eq!(grouped, verbs);
    }
}
