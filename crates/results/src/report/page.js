
// Values under the pointer, read back from the drawn lines: the page holds no second copy of its data.
(() => {
  const tip = document.getElementById('tip');
  const numbers = text => text.split(' ').map(Number);
  const text = value => Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3)
    ? value.toExponential(3) : String(Number(value.toPrecision(4)));
  // Ordinate of a line at px, between its corners; null in gaps.
  const at = (lines, px) => {
    for (const line of lines) {
      for (let i = 1; i < line.length; i++) {
        const [x0, y0] = line[i - 1], [x1, y1] = line[i];
        if (x0 <= px && px <= x1) return x1 > x0 ? y0 + (y1 - y0) * (px - x0) / (x1 - x0) : y1;
      }
    }
    return null;
  };
  for (const svg of document.querySelectorAll('svg.plot')) {
    const [left, top, right, bottom] = numbers(svg.dataset.frame);
    const [x0, x1] = numbers(svg.dataset.x), [y0, y1] = numbers(svg.dataset.y);
    const [xUnit, yUnit] = svg.dataset.units.split('|');
    const cursor = svg.querySelector('.cursor');
    let curves = null;
    svg.addEventListener('pointermove', event => {
      curves ??= [...svg.querySelectorAll('path[data-label]')].map(path => ({
        label: path.dataset.label, colour: getComputedStyle(path).stroke,
        lines: path.getAttribute('d').split('M').slice(1).map(l => l.split(' ').map(p => p.split(',').map(Number))),
      }));
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      if (point.x < left || point.x > right || point.y < top || point.y > bottom) return leave();
      let marks = `<line x1="${point.x}" x2="${point.x}" y1="${top}" y2="${bottom}"/>`;
      tip.replaceChildren();
      const row = (content, colour) => {
        const div = document.createElement('div');
        if (colour) { const dot = document.createElement('i'); dot.style.background = colour; div.append(dot); }
        div.append(content);
        tip.append(div);
      };
      row(`${svg.dataset.xname} ${text(x0 + (x1 - x0) * (point.x - left) / (right - left))} ${xUnit}`);
      for (const curve of curves) {
        const y = at(curve.lines, point.x);
        if (y === null) continue;
        const value = y1 - (y1 - y0) * (y - top) / (bottom - top);
        row(`${curve.label ? curve.label + ': ' : ''}${text(value)} ${yUnit}`, curve.colour);
        if (y >= top && y <= bottom) marks += `<circle cx="${point.x}" cy="${y}" r="4" fill="${curve.colour}"/>`;
      }
      cursor.innerHTML = marks;
      tip.hidden = false;
      const beside = event.clientX + 16 + tip.offsetWidth > innerWidth ? event.clientX - 16 - tip.offsetWidth : event.clientX + 16;
      tip.style.left = beside + 'px';
      tip.style.top = event.clientY + 12 + 'px';
    });
    const leave = () => { tip.hidden = true; cursor.replaceChildren(); };
    svg.addEventListener('pointerleave', leave);
  }
})();
