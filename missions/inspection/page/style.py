"""The style sheet of a report: for light and dark screens, from 400 pixels on."""

STYLE = """
:root { color-scheme: light dark; --paper: #fff; --ink: #1b2430; --dim: #667085; --line: #d8dee8;
  --panel: #f6f8fb; --good: #12805c; --bad: #c92a2a; --warn: #b25e00; --busy: #1f6feb;
  --run1: #1f6feb; --run2: #d9480f; --run3: #2b8a3e; --run4: #862e9c; }
@media (prefers-color-scheme: dark) { :root { --paper: #0b1018; --ink: #e6edf7; --dim: #93a5c1;
  --line: #24344f; --panel: #111a28; --good: #3ddc97; --bad: #ff6b6b; --warn: #ffc64d;
  --busy: #5aa2ff; --run1: #5aa2ff; --run2: #ff9b5a; --run3: #69db7c; --run4: #d0a2ff; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 16px; max-width: 1500px; background: var(--paper);
  color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.5rem; margin: 0; } h2 { font-size: 1.05rem; margin: 1.4rem 0 .4rem; }
.runs { display: flex; flex-wrap: wrap; gap: 20px; } .run { flex: 1 1 340px; min-width: 0;
  container-type: inline-size; }
.run.wide { flex-grow: 2; } .plots { display: grid; gap: 0 20px;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 360px), 1fr)); }
.word { font-weight: 700; } .word.success { color: var(--good); } .word.failure, .word.error {
  color: var(--bad); } .word.aborted, .word.interrupted { color: var(--warn); }
.lead { font-size: 1.05rem; margin: .3rem 0 .8rem; overflow-wrap: anywhere; }
.dim, .small { color: var(--dim); fill: var(--dim); } .small { font-size: 12px; }
svg { width: 100%; height: auto; display: block; font-family: system-ui, sans-serif; }
figure { margin: 0 0 10px; background: var(--panel); border: 1px solid var(--line);
  border-radius: 8px; padding: 8px; overflow: hidden; } figure.plot { max-width: 620px; }
figcaption b { margin-right: 10px; } figcaption { font-size: 13px; line-height: 1.4; }
.map figcaption, .timeline figcaption { color: var(--dim); margin-top: 6px; }
.key { display: inline-block; margin-right: 12px; } .key svg { display: inline-block;
  width: auto; vertical-align: -1px; } .key .failed { color: var(--bad); margin: 0; }
.tick { font-size: 12px; fill: var(--dim); }
.axis { stroke: var(--line); } .curve { fill: none; stroke-width: 1.4; }
image { image-rendering: pixelated; }
polyline { fill: none; stroke-width: 3; stroke-linejoin: round; stroke-linecap: round; }
.speed0 { stroke: #7048e8; } .speed1 { stroke: #4263eb; } .speed2 { stroke: #1098ad; }
.speed3 { stroke: #2b8a3e; } .speed4 { stroke: #82c91e; }
.jump { stroke: var(--dim); stroke-width: 1.2; stroke-dasharray: 1.5 4; }
.stood { fill: none; stroke: var(--ink); stroke-width: 1.6; stroke-dasharray: 3 2; }
.key line { stroke-width: 4; }
.heldmark { fill: none; stroke: var(--warn); stroke-width: 2.5; }
.stopped { fill: var(--warn); } .slower { fill: var(--warn); opacity: .45; }
.truth { stroke: var(--ink); stroke-width: 1.6; stroke-dasharray: 5 4; }
.block { fill: none; stroke-width: 2; }
.shut { stroke: var(--bad); stroke-width: 5; } .person { fill: var(--run4);
  stroke: var(--paper); fill-opacity: .75; } .map text { paint-order: stroke; stroke: var(--panel);
  stroke-width: 3px; stroke-linejoin: round; }
.small.blocker { fill: var(--ink); font-weight: 600; }
.moved { fill: var(--warn); stroke: var(--paper); }
.place { fill: none; stroke: var(--dim); }
.begin { fill: var(--paper); stroke: var(--ink); stroke-width: 2; }
.end { fill: var(--ink); } .mark { fill: var(--bad); font-size: 15px; font-weight: 700; }
.good { fill: var(--good); } .bad { fill: var(--bad); } .busy { fill: var(--busy); }
.idle { fill: var(--dim); opacity: .55; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; }
td, th { text-align: left; vertical-align: top; padding: 3px 8px 3px 0;
  border-bottom: 1px solid var(--line);
  overflow-wrap: break-word; } th { color: var(--dim); font-weight: 500; }
td.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
@container (max-width: 620px) { .map .small { font-size: 17px; } .mark { font-size: 22px; } }
@container (max-width: 420px) { .map .small { font-size: 22px; } .mark { font-size: 28px; } }
tr.warning td.source { color: var(--warn); } tr.error td.source { color: var(--bad); }
code { font-size: .85rem; background: var(--panel); padding: 1px 3px; border-radius: 4px; }
.note { border-left: 4px solid var(--warn); background: var(--panel); padding: 8px 12px;
  border-radius: 4px; margin: 0 0 8px; } .note ul { margin: 4px 0; padding-left: 20px; }
.narrow { display: none; }
td.number, td.source { width: 1%; padding-right: 14px; }
td.source { white-space: nowrap; } tr.head th { white-space: nowrap; }
.row { display: grid; align-items: center; gap: 8px;
  grid-template-columns: minmax(110px, 28%) 1fr; font-size: 13px; line-height: 1.5; }
.row .label { white-space: nowrap; overflow: hidden; text-overflow: ellipsis; color: var(--dim); }
.row svg { height: 13px; } .ticks { position: relative; height: 1.6em; color: var(--dim);
  font-size: 12px; border-top: 1px solid var(--line); } .ticks span { position: absolute;
  transform: translateX(-50%); white-space: nowrap; } .ticks span:first-child { transform: none; }
@media (max-width: 620px) { .scroll tr { display: block; padding: 6px 0;
  border-bottom: 1px solid var(--line); } .scroll td { display: block; border: 0; padding: 1px 0; }
  .scroll tr.head { display: none; } .narrow { display: inline; } }
.scroll { overflow-x: auto; } details > summary { cursor: pointer; color: var(--dim); }
"""
