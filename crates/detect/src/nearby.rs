//! Sorts places of a picture into cells for fast lookup of neighbours.

/// Side of the cells, in pixels.
const CELL_PX: f32 = 24.0;

/// Places by index. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearby {
    columns: usize,
    rows: usize,
    places: Vec<[f32; 2]>,
    /// Indices of the places sorted by cell, and the start of each cell.
    sorted: Vec<u32>,
    begins: Vec<u32>,
}

impl Nearby {
    /// Starts with the places in a picture of the given width and height.
    pub(super) fn start(
        &mut self,
        places: impl Iterator<Item = [f32; 2]>,
        [width, height]: [u32; 2],
    ) {
        self.columns = (width as f32 / CELL_PX) as usize + 1;
        self.rows = (height as f32 / CELL_PX) as usize + 1;
        self.places.clear();
        self.places.extend(places);
        self.begins.clear();
        self.begins.resize(self.columns * self.rows + 1, 0);
        let cell = |[x, y]: [f32; 2]| {
            let (column, row) = ((x / CELL_PX) as usize, (y / CELL_PX) as usize);
            row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
        };
        for place in &self.places {
            self.begins[cell(*place) + 1] += 1;
        }
        for k in 1..self.begins.len() {
            self.begins[k] += self.begins[k - 1];
        }
        self.sorted.clear();
        self.sorted.resize(self.places.len(), 0);
        // In reverse order each cell fills from its end, which is the start of the next one.
        for (index, place) in self.places.iter().enumerate().rev() {
            let end = &mut self.begins[cell(*place) + 1];
            *end -= 1;
            self.sorted[*end as usize] = index as u32;
        }
        self.begins.rotate_left(1);
        if let Some(last) = self.begins.last_mut() {
            *last = self.places.len() as u32;
        }
    }

    /// Places within `radius_px` of a place, with distances.
    pub(super) fn near(
        &self,
        at: [f32; 2],
        radius_px: f32,
    ) -> impl Iterator<Item = (usize, f32)> + '_ {
        let cell = |value: f32, count: usize| ((value / CELL_PX).max(0.0) as usize).min(count - 1);
        let first = cell(at[0] - radius_px, self.columns);
        let last = cell(at[0] + radius_px, self.columns);
        let rows = cell(at[1] - radius_px, self.rows)..=cell(at[1] + radius_px, self.rows);
        rows.flat_map(move |row| {
            let row = row * self.columns;
            // Cells of a row are adjacent.
            let (begin, end) = (self.begins[row + first], self.begins[row + last + 1]);
            &self.sorted[begin as usize..end as usize]
        })
        .filter_map(move |&index| {
            let [x, y] = self.places[index as usize];
            let (dx, dy) = (x - at[0], y - at[1]);
            let distance = (dx * dx + dy * dy).sqrt();
            (distance <= radius_px).then_some((index as usize, distance))
        })
    }
}
