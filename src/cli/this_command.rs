//! The command line of the run, to type again.

use boresight_capture::without_secrets;
use boresight_geometry::boards::BoardChoice;
use boresight_present::text::terminal::quoted;

/// Most words of a command to paste.
const MOST_WORDS: usize = 20;

/// Command line of the run, quoted for a shell.
#[cfg(feature = "report")]
pub(super) fn this_command() -> String {
    joined(&words())
}

/// Command line of the run with `board` instead of the named board; only the argument if a shell
/// has replaced a pattern by many names.
pub(super) fn with_board(board: BoardChoice) -> String {
    let words = replaced(words(), &board.to_string());
    if words.len() > MOST_WORDS { format!("--board {board}") } else { joined(&words) }
}

fn words() -> Vec<String> {
    let words = std::env::args_os().skip(1);
    words.map(|word| without_secrets(&word.to_string_lossy())).collect()
}

fn joined(words: &[String]) -> String {
    let words = words.iter().map(|word| quoted(word));
    std::iter::once("boresight".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// `words` with the value of `--board` replaced; the command comes first.
fn replaced(words: Vec<String>, board: &str) -> Vec<String> {
    let mut is_value = false;
    let mut kept = words.into_iter().filter(|word| {
        let is_old = is_value || word.starts_with("--board=");
        is_value = !is_value && word == "--board";
        !is_old && !is_value
    });
    let command = kept.next();
    let board = ["--board".to_owned(), board.to_owned()];
    command.into_iter().chain(board).chain(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_to_paste_names_one_board() {
        let typed = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
        for before in
            ["detect --json my", "detect --board 9x6 --json my", "detect --json --board=9x6 my"]
        {
            let after = joined(&replaced(typed(before), "10x7"));
            assert_eq!(after, "boresight detect --board 10x7 --json my");
        }
    }
}
