// The page's parts, as they are in their files.
.section .rodata
.macro embed name, file
.global \name\()_begin
.global \name\()_end
\name\()_begin:
.incbin "\file"
\name\()_end:
.endm
embed facetwise_report_html, PAGE_HTML
embed facetwise_report_css, PAGE_CSS
embed facetwise_report_js, PAGE_JS
embed facetwise_report_d3, PAGE_D3
.section .note.GNU-stack,"",%progbits
