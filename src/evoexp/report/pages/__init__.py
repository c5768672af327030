"""Pages: the figures, claims and checks that the report of an experiment has.

Packages register pages in the entry-point group `evoexp.pages`, as `package:page.yaml` (see
`page_file`) or as `module:function`; the option `report.figures` names one of them.
"""
