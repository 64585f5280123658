brainshift_test(client_report_test
  SOURCES report_chart_test.cpp report_page_test.cpp report_slice_test.cpp report_xy_chart_test.cpp
  LINKS brainshift::report brainshift::geometry brainshift::io brainshift_opencv)

# The command line: exit status and the one line on stderr.
function(brainshift_cli_test name status expected)
  add_test(NAME client_cli.${name}
    COMMAND ${CMAKE_COMMAND} -DSTATUS=${status} -DEXPECTED=${expected} "-DARGUMENTS=${ARGN}"
            -DBINARY=$<TARGET_FILE:brainshift> -P ${CMAKE_SOURCE_DIR}/tests/unit/client/report_cli_check.cmake)
  set_tests_properties(client_cli.${name} PROPERTIES LABELS unit)
endfunction()
brainshift_cli_test(no_command 2 "subcommand")
brainshift_cli_test(unknown_command 2 "dance" dance)
brainshift_cli_test(unknown_option 2 "--sped" replay a.surgery --report r.json --sped max)
brainshift_cli_test(bad_choice 2 "--speed" replay a.surgery --report r.json --speed 2x)
brainshift_cli_test(timeout_not_a_number 2 "--timeout-s" replay a.surgery --report r.json --timeout-s nan)
brainshift_cli_test(repeat_zero 2 "--repeat" replay a.surgery --report r.json --repeat 0)
brainshift_cli_test(repeat_negative 2 "--repeat" replay a.surgery --report r.json --repeat -2)
brainshift_cli_test(repeat_fraction 2 "--repeat" replay a.surgery --report r.json --repeat 1.5)
brainshift_cli_test(repeat_too_often 2 "--repeat" replay a.surgery --report r.json --repeat 99999999999)
brainshift_cli_test(unknown_method 2 "--method" replay a.surgery --report r.json --method newton)
foreach(method condensed condensed-exact paper paper-woodbury cg pcg)
  brainshift_cli_test(method_${method} 2 "nowhere.surgery" replay nowhere.surgery --report r.json --method ${method})
endforeach()
brainshift_cli_test(negative_seed 2 "--seed" simulate --case c --scenario paper --out s --seed -3)
brainshift_cli_test(missing_required 2 "--report" replay a.surgery)
brainshift_cli_test(missing_surgery 2 "nowhere.surgery" replay nowhere.surgery --report r.json)
brainshift_cli_test(missing_report 2 "nowhere.json" report nowhere.json --out out)
brainshift_cli_test(simulate_needs_case 2 "--case" simulate --scenario paper --out s.surgery)
brainshift_cli_test(simulate_missing_case 2 "nowhere.yaml" simulate --case nowhere.yaml --scenario paper --out s.surgery)
brainshift_cli_test(version 0 "" --version)
brainshift_cli_test(help 0 "" replay --help)
brainshift_cli_test(list_scenarios 0 "" simulate --list)
