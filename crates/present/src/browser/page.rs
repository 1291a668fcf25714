//! One HTML file from what all pages have and what one has for itself.

/// Parts of a page of its own.
#[derive(Clone, Copy, Debug)]
pub struct Own<'a> {
    /// Elements after the shared ones.
    pub body: &'a str,
    /// Script after the shared one.
    pub script: &'a str,
}

/// The page: one file with style and script in it, which loads nothing.
pub fn page(own: Own<'_>) -> String {
    let parts = [
        include_str!("head.html"),
        "<style>\n",
        include_str!("style.css"),
        "</style>\n</head>\n<body>\n",
        include_str!("body.html"),
        own.body,
        "<script>\n",
        include_str!("show.js"),
        own.script,
        "</script>\n</body>\n</html>\n",
    ];
    parts.concat()
}
