//! Layout of the words: beside the drawing, or below it on a narrow terminal.

/// Gap between the drawing and the words beside the drawing.
const GAP: &str = "  ";
/// Minimum width of words beside the drawing: slightly more than the line of the keys.
const LEAST_BESIDE: usize = 40;

/// Places the `words` beside or below the `drawing`, for a terminal of `width` characters. Lines
/// break between words; a drawing wider than the terminal is left out.
pub(super) fn laid_out(drawing: &[String], words: &[String], width: usize) -> Vec<String> {
    let drawn = drawing.iter().map(|line| line.chars().count()).max().unwrap_or(0);
    let beside = width.saturating_sub(drawn + GAP.len());
    if beside < LEAST_BESIDE {
        let above = drawing.iter().filter(|_| drawn <= width);
        let above = above.map(|line| line.trim_end().to_owned());
        return above.chain(words.iter().flat_map(|line| broken(line, width))).collect();
    }
    let words: Vec<String> = words.iter().flat_map(|line| broken(line, beside)).collect();
    let line = |lines: &[String], at: usize| lines.get(at).cloned().unwrap_or_default();
    (0..drawing.len().max(words.len()))
        .map(|at| format!("{:drawn$}{GAP}{}", line(drawing, at), line(&words, at)))
        .map(|line| line.trim_end().to_owned())
        .collect()
}

/// Breaks a line into lines of at most `width` characters, unless a word is longer.
fn broken(line: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in line.split(' ') {
        match lines.last_mut() {
            Some(last) if last.is_empty() => last.push_str(word),
            Some(last) if last.chars().count() + 1 + word.chars().count() <= width => {
                last.push(' ');
                last.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines.into_iter().map(|line| line.trim_end().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words_on_every_width() {
        let drawing = vec!["⠿".repeat(30), format!("{:^30}", "now")];
        let words = ["Move the board to the left and hold it still", "", "3 taken, about 1 more"];
        let words = words.map(str::to_owned);
        for width in 10..100 {
            let lines = laid_out(&drawing, &words, width);
            assert!(lines.iter().all(|line| line.chars().count() <= width), "{width}: {lines:#?}");
            let said: Vec<&str> = lines
                .iter()
                .flat_map(|line| line.split_whitespace())
                .filter(|word| !word.starts_with('⠿') && *word != "now")
                .collect();
            assert_eq!(said, words.join(" ").split_whitespace().collect::<Vec<_>>(), "{width}");
            assert_eq!(lines[0].contains('⠿'), width >= 30, "{width}: {lines:#?}");
        }
        // Beside the drawing, no words are below it.
        assert_eq!(laid_out(&drawing, &words, 80).len(), 3);
        assert_eq!(laid_out(&drawing, &words, 40).len(), 2 + 4);
    }
}
