"""The look of all pages: on a screen, on a phone, on paper. Nothing in it asks for another file."""

from __future__ import annotations

CSS = """
:root { --ink: #1b1b1b; --soft: #474747; --line: #d8d8d8; --bad: #b00020; --good: #1b6b3a; --doubt: #8a5000; --link: #004f87; }
* { box-sizing: border-box; }
html { scroll-behavior: smooth; -webkit-text-size-adjust: 100%; }
body { font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: var(--ink); background: #fff;
  max-width: 66rem; margin: 0 auto; padding: 1.2rem; overflow-wrap: break-word; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: .4rem 0 .6rem; }
h2 { font-size: 1.3rem; line-height: 1.3; margin: 2.6rem 0 .6rem; border-bottom: 2px solid var(--line);
  padding-bottom: .25rem; }
h3 { font-size: 1.05rem; margin: 1.6rem 0 .4rem; }
p, ul, ol { margin: .5rem 0; max-width: 46rem; } a { color: var(--link); }
.lead { font-size: 1.05rem; color: var(--soft); }
.wide { overflow-x: auto; margin: .6rem 0; }
table { border-collapse: collapse; font-size: .88rem; }
caption { text-align: left; color: var(--soft); padding: .2rem 0; }
th, td { padding: .32rem .7rem; text-align: left; vertical-align: top; border-bottom: 1px solid var(--line); }
th { font-weight: 600; } thead th { border-bottom: 2px solid #666; vertical-align: bottom; line-height: 1.25; }
td { min-width: 3.5rem; max-width: 34rem; } td.text { min-width: 15rem; overflow-wrap: anywhere; }
th[scope=row] { white-space: nowrap; } th[scope=rowgroup] { min-width: 7rem; } tbody th[scope=row] { font-weight: 400; }
tbody { border-bottom: 1px solid #999; } tbody tr:hover { background: #f6f8fa; }
thead th.number, td.number { text-align: right; font-variant-numeric: tabular-nums; }
td.number { white-space: nowrap; } td.number small { display: block; color: var(--soft); font-size: .78rem; line-height: 1.2; }
.bad { color: var(--bad); font-weight: 600; }
.box { border-left: .4rem solid; border-radius: .2rem; padding: .7rem 1rem; margin: 1.1rem 0; }
.failure { border-color: var(--bad); background: #fdecee; } .warning { border-color: #b26a00; background: #fff4e0; }
.success { border-color: var(--good); background: #e9f5ee; } .note { border-color: #5b7c99; background: #eff4f8; }
.box h2 { font-size: 1.1rem; border: 0; margin: 0 0 .3rem; padding: 0; } .box ul { margin: 0; padding-left: 1.2rem; }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(8.4rem, 1fr)); gap: .7rem; margin: 1.2rem 0;
  padding: 0; }
.facts div { border: 1px solid var(--line); border-top: .25rem solid #7a8b99; border-radius: .25rem; padding: .5rem .7rem; }
.facts .good { border-top-color: var(--good); } .facts .bad { border-top-color: var(--bad); font-weight: 400; color: inherit; }
.facts .doubt { border-top-color: #b26a00; }
.facts dt { font-size: .8rem; color: var(--soft); } .facts dd { margin: 0; }
.facts .value { font-size: 1.15rem; font-weight: 600; line-height: 1.3; } .facts .bad .value { color: var(--bad); }
.facts .good .value { color: var(--good); } .facts .doubt .value { color: var(--doubt); }
.facts .remark { font-size: .82rem; color: var(--soft); }
.contents { border: 1px solid var(--line); border-radius: .25rem; padding: .5rem .9rem; margin: 1.2rem 0; font-size: .92rem; }
.contents ul { display: flex; flex-wrap: wrap; gap: .15rem 1.4rem; list-style: none; margin: 0; padding: 0; max-width: none; }
figure { margin: 1.2rem 0 1.8rem; } img { max-width: 100%; height: auto; display: block; }
figcaption { color: var(--soft); font-size: .9rem; margin-top: .3rem; max-width: 46rem; }
.pairs { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 27rem), 1fr)); gap: 1.2rem 1.8rem;
  margin: 1rem 0; }
.pairs figure { margin: 0; }
details { margin: .5rem 0; } summary { cursor: pointer; color: var(--link); } .box summary { color: inherit; }
footer { margin-top: 2rem; color: var(--soft); font-size: .85rem; }
:target { scroll-margin-top: .5rem; }
  .wide:focus-visible, a:focus-visible, summary:focus-visible { outline: 2px solid var(--link); }
@media (max-width: 40rem) { body { padding: .8rem; font-size: 15px; } th, td { padding: .28rem .45rem; }
  h1 { font-size: 1.4rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
  .facts { grid-template-columns: 1fr 1fr; gap: .5rem; } .facts .value { font-size: 1.05rem; } .contents li { flex: 1 1 8rem;
  } }
@page { margin: 14mm 12mm; }
@media print { body { max-width: none; font-size: 10pt; padding: 0; } h1 { font-size: 17pt; } h2 { font-size: 13pt;
  margin-top: 1.4rem; }
  h2, h3, thead { break-after: avoid; } figure, tr, .facts, .facts div { break-inside: avoid; }
  thead { display: table-header-group; }
  figure { margin: .6rem 0 1rem; } figure img { max-width: min(100%, 165mm); max-height: 235mm; } .wide { overflow: visible;
  } table { font-size: 7.5pt; }
  th, td { padding: .2rem .35rem; } td, td.text { min-width: 0; } td, th { overflow-wrap: anywhere; }
  th[scope=row] { white-space: normal; } th[scope=rowgroup] { min-width: 0; }
  .pairs { grid-template-columns: 1fr 1fr; gap: .8rem 1rem; } p, ul, ol, figcaption { max-width: none; }
  h2 + p { break-after: avoid; }
  details::details-content { content-visibility: visible; block-size: auto; } summary { list-style: none; color: inherit; }
  td.number small { white-space: normal; font-size: 6pt; }
  .contents { display: none; } a { color: inherit; text-decoration: none; } * { print-color-adjust: exact; } }
"""  # noqa: E501
