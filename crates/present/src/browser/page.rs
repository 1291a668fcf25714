//! One HTML file from the shared parts and a page's own parts.

/// Page-specific parts.
#[derive(Clone, Copy, Debug)]
pub struct Own<'a> {
    /// Elements after the shared elements.
    pub body: &'a str,
    /// Script after the shared script.
    pub script: &'a str,
}

/// Self-contained page: one file with inline style and script.
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
