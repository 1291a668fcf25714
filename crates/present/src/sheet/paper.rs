/// Paper sizes of printers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paper {
    /// 210 × 297 mm.
    A4,
    /// 8.5 × 11 in.
    Letter,
    /// 297 × 420 mm.
    A3,
}

/// Pixels per metre, a whole number as in PNG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    per_m: u32,
}

/// Paper or screen for the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Page {
    /// Width of the page.
    pub width_mm: f64,
    /// Height of the page.
    pub height_mm: f64,
    /// Unprintable margin along each edge.
    pub margin_mm: f64,
    /// Type size.
    pub text_mm: f64,
    /// Pixels of a screen, to which the squares are aligned.
    pub pixels: Option<Resolution>,
}

impl Paper {
    /// All paper sizes, smallest first.
    pub const ALL: [Self; 3] = [Self::A4, Self::Letter, Self::A3];

    /// Name of the paper, such as "A4".
    pub fn name(self) -> &'static str {
        match self {
            Self::A4 => "A4",
            Self::Letter => "Letter",
            Self::A3 => "A3",
        }
    }

    /// Landscape and portrait.
    pub fn pages(self) -> [Page; 2] {
        let (short_mm, long_mm) = match self {
            Self::A4 => (210.0, 297.0),
            Self::Letter => (215.9, 279.4),
            Self::A3 => (297.0, 420.0),
        };
        let page = |width_mm, height_mm| Page {
            width_mm,
            height_mm,
            margin_mm: 5.0,
            text_mm: 2.5,
            pixels: None,
        };
        [page(long_mm, short_mm), page(short_mm, long_mm)]
    }
}

impl Resolution {
    /// Resolution from pixels per inch; `None` outside 20 to 1200.
    pub fn from_dpi(dpi: f64) -> Option<Self> {
        // The range fits.
        (20.0..=1200.0).contains(&dpi).then(|| Self { per_m: (dpi / 0.0254).round() as u32 })
    }

    /// Pixels per metre.
    pub fn per_m(self) -> u32 {
        self.per_m
    }

    /// Pixels per millimetre.
    pub fn per_mm(self) -> f64 {
        f64::from(self.per_m) / 1000.0
    }
}

impl Page {
    /// A whole screen.
    pub fn screen(width_px: u32, height_px: u32, resolution: Resolution) -> Self {
        let mm = |px: f64| px / resolution.per_mm();
        Self {
            width_mm: mm(width_px.into()),
            height_mm: mm(height_px.into()),
            margin_mm: mm(8.0),
            // Small print on a coarse screen is unreadable.
            text_mm: mm(13.0).max(2.5),
            pixels: Some(resolution),
        }
    }
}
