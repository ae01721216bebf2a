//! The style of the page. Sizes follow a scale of 4 px; the text column is about 70 characters wide.

/// CSS of the page, without that of the figures.
pub(super) const PAGE: &str = "
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%;text-size-adjust:100%}
body{margin:0;background:var(--bg);color:var(--ink);font:16px/1.6 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif;font-variant-numeric:tabular-nums;text-rendering:optimizeLegibility}
main{max-width:1088px;margin:0 auto;padding:56px 24px 64px}
p,ul,ol,dl.terms{max-width:70ch}
p{margin:0 0 16px}
h1{font-size:2.1rem;line-height:1.18;letter-spacing:-.018em;font-weight:650;margin:0 0 16px;max-width:26em;text-wrap:balance}
h2{font-size:1.4rem;line-height:1.25;letter-spacing:-.01em;font-weight:620;margin:0 0 16px}
h3{font-size:1.02rem;font-weight:620;margin:36px 0 10px}
section{margin-top:64px;scroll-margin-top:16px}
.over{font-size:.82rem;letter-spacing:.06em;color:var(--muted);margin:0 0 8px}
.lead{font-size:1.2rem;line-height:1.5;max-width:62ch;text-wrap:pretty}
.chip{display:inline-block;font-size:.82rem;line-height:1;font-weight:600;padding:6px 10px;border:1px solid var(--accent);color:var(--accent);border-radius:99px;vertical-align:.14em;margin-right:4px;white-space:nowrap}
.keys{display:grid;grid-template-columns:repeat(auto-fit,minmax(168px,1fr));gap:24px 32px;margin:32px 0 0;padding:20px 0 0;border-top:1px solid var(--rule)}
.keys div{display:flex;flex-direction:column}
.keys dt{font-size:.85rem;color:var(--muted);line-height:1.35}
.keys dd{margin:2px 0 0}
.big{display:block;font-size:1.85rem;font-weight:600;letter-spacing:-.02em;line-height:1.25;white-space:nowrap}
.unit{font-size:1.05rem;font-weight:500;color:var(--muted);letter-spacing:0}
.note{display:block;font-size:.82rem;color:var(--muted);line-height:1.4}
nav{display:flex;flex-wrap:wrap;gap:4px 20px;margin-top:32px;padding:10px 0;border-top:1px solid var(--rule);border-bottom:1px solid var(--rule);font-size:.88rem}
a{color:var(--accent);text-decoration-thickness:1px;text-underline-offset:3px}
nav a{text-decoration:none;padding:2px 0}
a:hover{text-decoration:underline}
:focus-visible{outline:2px solid var(--accent);outline-offset:3px;border-radius:2px}
code{font:.88em/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,'Liberation Mono',monospace;overflow-wrap:anywhere}
p code,li code,dd code,dt code,td code,th code,figcaption code{background:var(--panel);padding:.1em .3em;border-radius:3px}
.callout{border-left:3px solid var(--accent);padding:4px 0 4px 16px}
figure{margin:24px 0 0}
figcaption,.foot{font-size:.86rem;line-height:1.5;color:var(--muted);max-width:80ch}
figure>figcaption{margin-top:8px}
.code figcaption{margin:0 0 6px}
pre{margin:0;background:var(--panel);border-radius:6px;padding:16px 18px;overflow-x:auto;font-size:.94rem}
pre code{overflow-wrap:normal}
.terms{margin:0 0 16px}
.terms div{margin-top:10px}
.terms dt{font-weight:600}
.terms dd{margin:0;color:var(--ink)}
.methods{padding-left:22px}
.methods li{margin-top:6px}
.ref{color:var(--muted)}
.scroll{overflow-x:auto;margin-top:20px;background:linear-gradient(90deg,var(--bg) 40%,transparent) 0 0/40px 100% no-repeat local,linear-gradient(270deg,var(--bg) 40%,transparent) 100% 0/40px 100% no-repeat local,linear-gradient(90deg,var(--rule),transparent) 0 0/14px 100% no-repeat scroll,linear-gradient(270deg,var(--rule),transparent) 100% 0/14px 100% no-repeat scroll}
details{margin-top:20px}
summary{cursor:pointer;color:var(--accent);font-size:.93rem}
table{border-collapse:collapse;font-size:.93rem;line-height:1.4;min-width:min(100%,560px)}
.cap{font-weight:600;margin:28px 0 0}
h2+.cap{margin-top:0}
.cap+.scroll{margin-top:8px}
th,td{padding:8px 16px 8px 0;text-align:left;vertical-align:baseline}
th:last-child,td:last-child{padding-right:4px}
thead th{font-weight:500;color:var(--muted);font-size:.85rem;border-bottom:1px solid var(--muted);vertical-align:bottom}
thead .unit{display:block;font-size:.85em;font-weight:400}
tbody th{font-weight:500}
tbody tr+tr>*{border-top:1px solid var(--grid)}
tbody tr.new+tr.new>*,tbody tr.sep>*{border-top:1px solid var(--rule)}
.num{text-align:right}
td.num{white-space:nowrap}
th code,td code,.nw,.unit{white-space:nowrap}
.lead code{background:none;padding:0}
.ci{color:var(--muted);font-size:.88em;white-space:nowrap;margin-left:.5em}
.best{font-weight:700}
.best::after{content:'';display:block;height:1.5px;margin:1px 0 -2.5px;background:var(--accent);border-radius:1px;margin-left:auto;width:100%;max-width:3.2em}
tr.strong>th,tr.strong>.num{font-weight:650}
tr.strong .ci{font-weight:400}
.foot{margin-top:10px}
.foot p{margin:0 0 2px;max-width:80ch}
.grid{display:grid;gap:32px 40px;align-items:start}
.c2{grid-template-columns:repeat(2,minmax(0,1fr))}
.c3{grid-template-columns:repeat(3,minmax(0,1fr));gap:28px 32px}
.grid figure{margin:0}
.legend{display:flex;flex-wrap:wrap;gap:2px 22px;list-style:none;padding:0;margin:0 0 14px;max-width:none;font-size:.86rem}
.legend li{display:flex;align-items:center;gap:7px}
.legend .fig{width:24px;flex:none}
.narrow{display:none}
footer{margin-top:72px;padding-top:16px;border-top:1px solid var(--rule);font-size:.84rem;color:var(--muted)}
footer dl{margin:0;display:grid;gap:2px}
footer div{display:grid;grid-template-columns:88px minmax(0,1fr)}
footer dd{margin:0;overflow-wrap:anywhere}
@media screen and (max-width:960px){.c3{grid-template-columns:repeat(2,minmax(0,1fr))}}
@media screen and (max-width:800px){.c2{grid-template-columns:minmax(0,1fr)}.wide{display:none}.narrow{display:block;max-width:540px}}
@media screen and (max-width:640px){
main{padding:32px 18px 48px}
h1{font-size:1.6rem}
.lead{font-size:1.07rem}
section{margin-top:48px}
.c3{grid-template-columns:minmax(0,1fr)}
.keys{grid-template-columns:repeat(2,minmax(0,1fr));gap:18px 20px}
.big{font-size:1.5rem}
th,td{padding-right:16px}
.tx{min-width:15em}
thead .num{min-width:6.5em}
.stick tbody th,.stick thead th:first-child{position:sticky;left:0;background:var(--bg)}
}
@media print{
@page{margin:16mm 14mm}
body{font-size:10pt}
:root{--bg:#fff}
.keys{grid-template-columns:repeat(4,1fr);gap:12pt}
.big{font-size:1.5rem}
main{max-width:none;padding:0}
nav{display:none}
section{margin-top:28pt}
h2,h3{break-after:avoid}
tr,.keys,.callout,.fig,.grid>div{break-inside:avoid}
.cap,.legend{break-after:avoid}
table{font-size:.85rem}
.grid{gap:14pt 18pt}
.scroll{overflow:visible;background:none}
table{width:100%;min-width:0}
th,td{padding-right:8pt}
td.num,th code,td code,.nw,.ci{white-space:normal;overflow-wrap:anywhere}
.tx{min-width:0}
pre{white-space:pre-wrap;border:1px solid var(--rule)}
a{color:inherit;text-decoration:none}
}
";
