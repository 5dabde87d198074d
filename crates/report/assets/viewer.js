// The interactive view: clouds and segments on bodies that move between states. It reads the scene that each
// `figure[data-view]` holds as JSON; src/scene/encode.rs writes it.
(() => {
  'use strict';

  // Half of the vertical angle of view, radians.
  const HALF_FIELD = 0.35;
  // Colours from no error to saturation: from dark to light, so also in grey, and seen on white at both ends.
  const RAMP = [[52, 56, 178], [132, 40, 178], [204, 71, 120], [241, 132, 75], [253, 188, 56]].map(c => c.map(v => v / 255));
  const GREY = [0.72, 0.72, 0.72];
  const HELP = [
    ['drag, arrow keys', 'turn'], ['shift + drag, two fingers', 'move'], ['wheel, pinch, + and −', 'zoom'],
    ['B', 'next position'], ['C', 'next colours'], ['[ and ]', 'point size'], ['1 to 9', 'layers'],
    ['X, Y, Z', 'look along an axis'], ['R', 'reset'], ['H', 'this help'],
  ];

  const CLOUD = `#version 300 es
    in vec3 position; in float error;
    uniform mat4 first, second, screen; uniform float size, distance_; uniform vec3 colour, up; uniform vec2 heights;
    uniform bool isCloud; uniform int mode;
    uniform vec3 stops[5]; uniform vec3 grey;
    out vec3 shade;
    vec3 pseudo(float share) {
      float at = clamp(share, 0.0, 1.0) * 4.0; int i = min(int(at), 3);
      return mix(stops[i], stops[i + 1], at - float(i));
    }
    void main() {
      vec4 placed = (gl_VertexID % 2 == 1 && !isCloud ? second : first) * vec4(position, 1.0);
      gl_Position = screen * placed;
      gl_PointSize = clamp(size * distance_ / gl_Position.w, 1.0, 6.0 * size);
      shade = colour;
      if (isCloud && mode == 1) shade = error > 0.999 ? grey : pseudo(error * 255.0 / 254.0);
      if (isCloud && mode == 2) shade = pseudo((dot(placed.xyz, up) - heights.x) / (heights.y - heights.x));
    }`;
  const DISC = `#version 300 es
    precision highp float;
    in vec3 shade; uniform bool isCloud; out vec4 pixel;
    void main() {
      vec2 q = gl_PointCoord - 0.5;
      if (isCloud && dot(q, q) > 0.25) discard;
      pixel = vec4(shade, 1.0);
    }`;
  const WHOLE = `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;
  // Points have no shading of their own: a pixel is darkened by how far its neighbours are in front of it.
  const DEPTH_SHADING = `#version 300 es
    precision highp float; precision highp sampler2D;
    uniform sampler2D colours, depths; uniform vec2 range; uniform int reach; out vec4 pixel;
    float far(ivec2 at) {
      float d = texelFetch(depths, clamp(at, ivec2(0), textureSize(depths, 0) - 1), 0).r;
      return d >= 1.0 ? 1e9 : log2(range.x * range.y / (range.y - d * (range.y - range.x)));
    }
    void main() {
      ivec2 at = ivec2(gl_FragCoord.xy);
      float here = far(at), darkness = 0.0;
      for (int x = -1; x <= 1; x++) for (int y = -1; y <= 1; y++)
        darkness += clamp(here - far(at + reach * ivec2(x, y)), 0.0, 0.006);
      vec3 colour = texelFetch(colours, at, 0).rgb;
      pixel = vec4(here > 1e8 ? colour : colour * exp(-35.0 * darkness), 1.0);
    }`;

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const plus = (a, b, k) => a.map((v, i) => v + k * b[i]);
  const unit = a => { const n = Math.hypot(...a) || 1; return a.map(v => v / n); };
  const turned = (a, axis, angle) => { // Rodrigues
    const c = Math.cos(angle), s = Math.sin(angle), k = dot(axis, a) * (1 - c), w = cross(axis, a);
    return a.map((v, i) => v * c + w[i] * s + axis[i] * k);
  };
  const rgb = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16) / 255);
  const css = c => `rgb(${c.map(v => Math.round(v * 255))})`;
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const count = n => n.toLocaleString('en').replace(/,/g, '\u202f');
  const tidy = v => String(+v.toPrecision(Math.abs(v) >= 1000 ? 7 : 3));

  function element(name, attributes, ...children) {
    const made = document.createElement(name);
    Object.assign(made, attributes);
    made.append(...children);
    return made;
  }

  // The direction that is up on the screen when looking along `forward`: y down for depth cameras, which look along +z;
  // y up for models seen along -z; else z up.
  const upFor = forward => Math.abs(forward[2]) < 0.7 ? [0, 0, 1] : [0, forward[2] > 0 ? -1 : 1, 0];

  class Camera {
    constructor(scene) { this.scene = scene; this.views = []; this.reset(); }
    reset() {
      const { radius, viewpoint } = this.scene;
      // A scanner amid the points is no place to see them from.
      const outside = viewpoint && Math.hypot(...viewpoint) > 1.2 * radius;
      this.look(unit(outside ? viewpoint.map(v => -v) : [-0.55, 0.7, -0.5]));
      this.vertical = upFor(this.back.map(v => -v));
      this.middle = [0, 0, 0];
      this.distance = 1.25 * radius / Math.tan(HALF_FIELD);
    }
    look(forward) {
      this.back = forward.map(v => -v);
      this.right = unit(cross(upFor(forward), this.back));
      this.up = cross(this.back, this.right);
    }
    orbit(x, y) {
      const turn = (axis, angle) => ['right', 'up', 'back'].forEach(k => { this[k] = turned(this[k], axis, angle); });
      turn(this.up, -x);
      turn(this.right, -y);
      this.back = unit(this.back); this.right = unit(cross(this.up, this.back)); this.up = cross(this.back, this.right);
    }
    pan(x, y) { this.middle = plus(plus(this.middle, this.right, -x), this.up, y); }
    zoom(factor) {
      const { radius } = this.scene;
      this.distance = Math.min(Math.max(this.distance * factor, radius * 1e-3), radius * 50);
    }
    range() { return [this.distance * 0.02, this.distance + 12 * this.scene.radius]; }
    // The matrix from the frame to the screen, column by column.
    screen(aspect) {
      // What fits is as wide as the shorter side.
      const [near, far] = this.range(), t = Math.min(aspect, 1) / Math.tan(HALF_FIELD);
      const eye = plus(this.middle, this.back, this.distance);
      const rows = [this.right, this.up, this.back], shift = rows.map(r => -dot(r, eye));
      const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
      const m = [];
      for (let c = 0; c < 3; c++) m.push(t / aspect * rows[0][c], t * rows[1][c], a * rows[2][c], -rows[2][c]);
      m.push(t / aspect * shift[0], t * shift[1], a * shift[2] + b, -shift[2]);
      return m;
    }
    changed() { this.views.forEach(view => view.ask()); }
  }

  class View {
    constructor(figure, camera) {
      this.figure = figure;
      this.scene = JSON.parse(figure.querySelector('script').textContent);
      this.canvas = element('canvas', {});
      this.gl = this.canvas.getContext('webgl2', { antialias: false, preserveDrawingBuffer: true });
      if (!this.gl) throw Error('WebGL 2 is not available');
      this.camera = camera || new Camera(this.scene);
      this.state = Math.max(this.scene.states.length - 1, 0);
      this.mode = this.scene.errors && figure.parentElement.querySelectorAll('[data-view]').length > 1 ? 1 : 0;
      this.layers = this.scene.layers.map(layer => ({ ...layer }));
      this.prepare();
      this.build();
      this.canvas.addEventListener('webglcontextlost', () => this.give_up());
      this.listen();
      this.camera.views.push(this);
      new ResizeObserver(() => this.ask()).observe(this.canvas);
      this.draw();
    }

    // Programs, buffers and the target of the first pass.
    prepare() {
      const { gl } = this;
      const program = (vertex, fragment) => {
        const made = gl.createProgram();
        [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].forEach(([kind, text]) => {
          const shader = gl.createShader(kind);
          gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(made, shader);
          if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(shader));
        });
        gl.bindAttribLocation(made, 0, 'position'); gl.bindAttribLocation(made, 1, 'error');
        gl.linkProgram(made);
        if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw Error(gl.getProgramInfoLog(made));
        return { made, at: new Proxy({}, { get: (known, name) => known[name] ??= gl.getUniformLocation(made, name) }) };
      };
      this.cloud = program(CLOUD, DISC);
      this.finish = program(WHOLE, DEPTH_SHADING);
      this.empty = gl.createVertexArray();
      this.heights = [Infinity, -Infinity];
      for (const layer of this.layers) this.upload(layer);
      if (!(this.heights[1] > this.heights[0])) this.heights = [this.heights[0] - 0.5 || -0.5, this.heights[1] + 0.5 || 0.5];
      this.target = gl.createFramebuffer();
    }

    upload(layer) {
      const { gl } = this, raw = bytes(layer.positions), steps = new Uint16Array(raw.buffer);
      layer.n = steps.length / 3;
      layer.matrices = layer.motions.map(ends => ends.map(m => new Float32Array(m)));
      layer.vao = gl.createVertexArray(); gl.bindVertexArray(layer.vao);
      const attribute = (data, place, size, type) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
        gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, size, type, true, 0, 0);
      };
      attribute(steps, 0, 3, gl.UNSIGNED_SHORT);
      layer.hasErrors = layer.errors.length > 0;
      if (layer.hasErrors) attribute(bytes(layer.errors), 1, 1, gl.UNSIGNED_BYTE);
      if (layer.kind !== 'points') return;
      const m = layer.motions[this.state][0], up = this.camera.vertical;
      const slope = [0, 1, 2].map(c => dot(up, [m[4 * c], m[4 * c + 1], m[4 * c + 2]]) / 65535), rest = dot(up, m.slice(12));
      const all = Float64Array.from({ length: layer.n }, (_, i) => dot(slope, steps.subarray(3 * i, 3 * i + 3)) + rest).sort();
      if (!layer.n) return;
      const share = s => all[Math.round(s * (layer.n - 1))];
      this.heights = [Math.min(this.heights[0], share(0.01)), Math.max(this.heights[1], share(0.99))];
    }

    build() {
      const { scene } = this, bar = element('div', { className: 'controls' });
      if (scene.states.length > 1) {
        const buttons = scene.states.map((name, i) => element('button', { type: 'button', textContent: name, onclick: () => this.show(i) }));
        this.stateButtons = buttons;
        const group = element('div', { className: 'states' }, ...buttons);
        group.setAttribute('role', 'group'); group.setAttribute('aria-label', 'Positions');
        bar.append(group);
      }
      this.switches = this.layers.map(layer => {
        const box = element('input', { type: 'checkbox', checked: layer.shown, onchange: () => { layer.shown = box.checked; this.ask(); } });
        const swatch = element('i', { className: layer.kind });
        swatch.style.setProperty('--colour', layer.colour);
        const drawn = layer.kind === 'lines' ? layer.n / 2 : layer.n;
        const of = drawn < layer.total ? `${count(drawn)} of ${count(layer.total)} drawn` : count(drawn);
        bar.append(element('label', { title: of }, box, swatch, layer.name, element('small', { textContent: count(layer.total) })));
        return box;
      });
      const colours = [['0', 'scan'], ...(scene.errors ? [['1', scene.errors.name]] : []), ['2', `height (${this.axis()})`]];
      this.select = element('select', { onchange: () => { this.mode = +this.select.value; this.ask(); } },
        ...colours.map(([value, textContent]) => element('option', { value, textContent })));
      this.select.value = String(this.mode);
      bar.append(element('label', {}, 'colour by', this.select));
      this.slider = element('input', { type: 'range', min: 1, max: 12, step: 0.25, oninput: () => { this.size = +this.slider.value; this.ask(); } });
      bar.append(element('label', {}, 'point size', this.slider));
      bar.append(element('button', { type: 'button', textContent: 'reset', onclick: () => this.reset() }));
      const help = element('button', { type: 'button', textContent: 'help', onclick: () => this.help() });
      bar.append(help);
      this.legend = element('div', { className: 'legend', hidden: true });
      this.ruler = element('div', { className: 'ruler' });
      this.sheet = element('div', { className: 'help', hidden: true },
        ...HELP.flatMap(([keys, what]) => [element('b', { textContent: keys }), element('span', { textContent: what })]));
      const stage = element('div', { className: 'stage' }, this.canvas, this.ruler, this.legend, this.sheet);
      this.figure.querySelector('.fallback').hidden = true;
      this.figure.prepend(bar, stage);
      const most = Math.max(...this.layers.filter(l => l.kind === 'points').map(l => l.n), 1);
      // So many pixels, that the cloud closes where it fills some two fifths of the picture.
      const fitting = 1.35 * Math.sqrt(0.4 * this.side() ** 2 / most);
      this.size = Math.min(Math.max(fitting, 2), 9);
      this.slider.value = this.size;
    }

    axis() {
      const up = this.camera.vertical;
      return (dot(up, [1, 1, 1]) < 0 ? '−' : '') + 'xyz'[up.findIndex(v => v !== 0)];
    }

    side() { return Math.max(Math.min(this.canvas.clientWidth, this.canvas.clientHeight), 1); }
    show(state) { this.state = state; this.ask(); }
    help() { this.sheet.hidden = !this.sheet.hidden; }
    reset() { this.camera.reset(); this.camera.changed(); }
    give_up() {
      this.figure.querySelector('.fallback').hidden = false;
      this.figure.querySelectorAll('.controls, .stage').forEach(part => part.remove());
    }

    ask() {
      if (this.pending) return;
      this.pending = true;
      requestAnimationFrame(() => { this.pending = false; this.draw(); });
    }

    fit() {
      const { gl, canvas } = this, k = window.devicePixelRatio || 1;
      const width = Math.max(Math.round(canvas.clientWidth * k), 1), height = Math.max(Math.round(canvas.clientHeight * k), 1);
      if (canvas.width === width && canvas.height === height && this.colours) return;
      canvas.width = width; canvas.height = height;
      [this.colours, this.depths].forEach(texture => texture && gl.deleteTexture(texture));
      const texture = (inside, format, type, attachment) => {
        const made = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, made);
        gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, format, type, null);
        [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER].forEach(filter => gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST));
        gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, made, 0);
        return made;
      };
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
      this.colours = texture(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, gl.COLOR_ATTACHMENT0);
      this.depths = texture(gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, gl.DEPTH_ATTACHMENT);
    }

    draw() {
      const { gl, camera, canvas } = this, k = window.devicePixelRatio || 1;
      this.fit();
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.enable(gl.DEPTH_TEST); gl.clearColor(1, 1, 1, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const { made, at } = this.cloud;
      gl.useProgram(made);
      gl.uniformMatrix4fv(at.screen, false, camera.screen(canvas.width / canvas.height));
      gl.uniform1f(at.size, this.size * k); gl.uniform1f(at.distance_, camera.distance);
      gl.uniform1i(at.mode, this.mode); gl.uniform3fv(at.up, this.camera.vertical); gl.uniform2fv(at.heights, this.heights);
      gl.uniform3fv(at.stops, RAMP.flat()); gl.uniform3fv(at.grey, GREY);
      let drawn = 0;
      for (const layer of this.layers) {
        if (!layer.shown || !layer.n || this.mode === 1 && layer.kind === 'points' && !layer.hasErrors) continue;
        const [first, second = first] = layer.matrices[Math.min(this.state, layer.matrices.length - 1)];
        gl.uniformMatrix4fv(at.first, false, first); gl.uniformMatrix4fv(at.second, false, second);
        gl.uniform3fv(at.colour, rgb(layer.colour));
        gl.uniform1i(at.isCloud, layer.kind === 'points' ? 1 : 0);
        gl.bindVertexArray(layer.vao);
        // Lines within a body would not be seen.
        gl[layer.kind === 'points' ? 'enable' : 'disable'](gl.DEPTH_TEST);
        gl.drawArrays(layer.kind === 'points' ? gl.POINTS : gl.LINES, 0, layer.n);
        drawn += layer.n;
      }
      this.shade(k);
      this.annotate();
      this.figure.dataset.drawn = drawn;
    }

    shade(k) {
      const { gl, finish: { made, at } } = this;
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.disable(gl.DEPTH_TEST);
      gl.useProgram(made); gl.bindVertexArray(this.empty);
      gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, this.colours);
      gl.activeTexture(gl.TEXTURE1); gl.bindTexture(gl.TEXTURE_2D, this.depths);
      gl.uniform1i(at.colours, 0); gl.uniform1i(at.depths, 1);
      gl.uniform2fv(at.range, this.camera.range()); gl.uniform1i(at.reach, Math.max(Math.round(2 * k), 1));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      gl.activeTexture(gl.TEXTURE0);
    }

    annotate() {
      const { scene, canvas } = this;
      (this.stateButtons || []).forEach((button, i) => button.setAttribute('aria-pressed', String(i === this.state)));
      this.select.value = String(this.mode);
      this.slider.value = this.size;
      const perUnit = this.side() / (2 * this.camera.distance * Math.tan(HALF_FIELD));
      const most = 0.22 * canvas.clientWidth / perUnit, power = 10 ** Math.floor(Math.log10(most));
      const length = [5, 2, 1].map(d => d * power).find(d => d <= most) || power;
      this.ruler.style.width = `${length * perUnit}px`;
      this.ruler.dataset.length = `${tidy(length)} ${scene.unit}`;
      this.legend.hidden = this.mode === 0;
      if (this.mode === this.legendMode) return;
      this.legendMode = this.mode;
      const strip = element('div', { className: 'strip' });
      strip.style.background = `linear-gradient(to right, ${RAMP.map(css).join(', ')})`;
      const middle = dot(this.camera.vertical, scene.middle);
      const [title, low, high] = this.mode === 1
        ? [`${scene.errors.name} (${scene.errors.unit})`, '0', `${tidy(scene.errors.saturation)} and more`]
        : [this.select.selectedOptions[0].textContent, tidy(this.heights[0] + middle), tidy(this.heights[1] + middle)];
      this.legend.replaceChildren(element('div', { textContent: title }), strip,
        element('div', { className: 'ends' }, element('span', { textContent: low }), element('span', { textContent: high })));
      if (this.mode === 1 && scene.errors.grey) {
        const swatch = element('i', { className: 'points' });
        swatch.style.setProperty('--colour', css(GREY));
        this.legend.append(element('div', { className: 'grey' }, swatch, scene.errors.grey));
      }
    }

    listen() {
      const { canvas, camera } = this, fingers = new Map();
      const perPixel = () => 2 * camera.distance * Math.tan(HALF_FIELD) / this.side();
      const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y) || 1; };
      canvas.addEventListener('pointerdown', event => {
        canvas.setPointerCapture(event.pointerId);
        this.figure.focus({ preventScroll: true });
        fingers.set(event.pointerId, { x: event.clientX, y: event.clientY, moves: event.shiftKey || event.button > 0 });
      });
      canvas.addEventListener('pointermove', event => {
        const finger = fingers.get(event.pointerId);
        if (!finger) return;
        const before = fingers.size === 2 ? spread() : 1, x = event.clientX - finger.x, y = event.clientY - finger.y;
        finger.x = event.clientX; finger.y = event.clientY;
        if (fingers.size === 2) { camera.zoom(before / spread()); camera.pan(x / 2 * perPixel(), y / 2 * perPixel()); }
        else if (finger.moves) camera.pan(x * perPixel(), y * perPixel());
        else camera.orbit(x * 0.007, y * 0.007);
        camera.changed();
      });
      ['pointerup', 'pointercancel'].forEach(name => canvas.addEventListener(name, event => fingers.delete(event.pointerId)));
      canvas.addEventListener('contextmenu', event => event.preventDefault());
      canvas.addEventListener('wheel', event => {
        event.preventDefault();
        camera.zoom(Math.exp(Math.max(-200, Math.min(200, event.deltaY * (event.deltaMode ? 30 : 1))) * 0.0012)); camera.changed();
      }, { passive: false });
      this.figure.addEventListener('keydown', event => this.key(event, perPixel));
    }

    key(event, perPixel) {
      if (event.ctrlKey || event.metaKey || event.altKey || /^(SELECT|INPUT)$/.test(event.target.tagName) && event.key.startsWith('Arrow')) return;
      const { camera } = this, key = event.key.toLowerCase();
      const step = (x, y) => event.shiftKey ? camera.pan(-x * 30 * perPixel(), -y * 30 * perPixel()) : camera.orbit(x * 0.1, y * 0.1);
      const layer = this.layers[+key - 1];
      const actions = {
        arrowleft: () => step(-1, 0), arrowright: () => step(1, 0), arrowup: () => step(0, -1), arrowdown: () => step(0, 1),
        '+': () => camera.zoom(0.87), '=': () => camera.zoom(0.87), '-': () => camera.zoom(1.15),
        '[': () => { this.size = Math.max(this.size / 1.2, 1); }, ']': () => { this.size = Math.min(this.size * 1.2, 12); },
        b: () => this.show((this.state + 1) % Math.max(this.scene.states.length, 1)),
        c: () => { const all = [...this.select.options].map(o => +o.value); this.mode = all[(all.indexOf(this.mode) + 1) % all.length]; },
        x: () => camera.look([-1, 0, 0]), y: () => camera.look([0, 1, 0]), z: () => camera.look([0, 0, camera.vertical[1] < 0 ? 1 : -1]),
        r: () => camera.reset(), h: () => this.help(), escape: () => { this.sheet.hidden = true; },
      };
      if (layer) { layer.shown = !layer.shown; this.switches[+key - 1].checked = layer.shown; }
      else if (actions[key]) actions[key]();
      else return;
      event.preventDefault();
      camera.changed();
    }

    // Whether there is anything but white on the canvas.
    isInked() {
      const { gl, canvas } = this, pixels = new Uint8Array(4 * canvas.width * canvas.height);
      gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      let inked = 0;
      for (let i = 0; i < pixels.length; i += 4) inked += pixels[i] + pixels[i + 1] + pixels[i + 2] < 765;
      this.figure.dataset.inked = inked;
      return inked > 0;
    }
  }

  const root = document.documentElement;
  root.dataset.errors = '0';
  window.addEventListener('error', () => { root.dataset.errors = String(+root.dataset.errors + 1); });
  const cameras = new Map();
  document.querySelectorAll('figure[data-view]').forEach(figure => {
    let view;
    try {
      view = new View(figure, cameras.get(figure.parentElement));
      cameras.set(figure.parentElement, view.camera);
      // Some drivers draw nothing and say nothing; then the picture is better.
      if (view.layers.some(layer => layer.shown && layer.n) && !view.isInked()) view.give_up();
    } catch (error) {
      figure.dataset.problem = error.message;
      if (view) view.give_up();
    }
  });
})();
