# SPDX-License-Identifier: Apache-2.0
# What is installed, in components, and the .deb packages made of them (`cpack` in the build directory).
#   engine   facetwise::facetwise and facetwise::reference      client  facetwise::client      server  facetwise::server
#   c, c-dev the C interface                                    tools   the command
#   service  the unit of systemd and what else operates it      python  the Python package
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/facetwise)

# Libraries of a component with their headers, exported as facetwise-COMPONENT.cmake.
function(install_libraries component)
  cmake_parse_arguments(arg "" "" "TARGETS;INCLUDES" ${ARGN})
  foreach(target IN LISTS arg_TARGETS)
    target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  endforeach()
  install(TARGETS ${arg_TARGETS} EXPORT facetwise-${component} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    COMPONENT ${component})
  foreach(folder IN LISTS arg_INCLUDES)
    install(DIRECTORY ${folder}/facetwise DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT ${component}
      FILES_MATCHING PATTERN *.h)
  endforeach()
  install(EXPORT facetwise-${component} NAMESPACE facetwise:: DESTINATION ${package_folder} COMPONENT ${component})
endfunction()

function(install_pkg_config name component)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT ${component})
endfunction()

install_libraries(engine TARGETS facetwise facetwise_reference INCLUDES ${PROJECT_SOURCE_DIR}/engine/include)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/facetwise-config-version.cmake COMPATIBILITY SameMinorVersion)
configure_file(${PROJECT_SOURCE_DIR}/cmake/facetwise-config.cmake.in ${PROJECT_BINARY_DIR}/facetwise-config.cmake @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/facetwise-config.cmake ${PROJECT_BINARY_DIR}/facetwise-config-version.cmake
  DESTINATION ${package_folder} COMPONENT engine)
if(FACETWISE_TBB)
  set(tbb_package " tbb")
endif()
install_pkg_config(facetwise-engine engine)
if(FACETWISE_ENGINE_ONLY)
  return()
endif()

set_target_properties(facetwise_client PROPERTIES EXPORT_NAME client)
set_target_properties(facetwise_server PROPERTIES EXPORT_NAME server)
set_target_properties(facetwise_proto PROPERTIES EXPORT_NAME proto)
install_libraries(client TARGETS facetwise_client facetwise_wire facetwise_proto
  INCLUDES ${PROJECT_SOURCE_DIR}/service/client/include ${PROJECT_SOURCE_DIR}/service/wire/include
           ${PROJECT_BINARY_DIR}/proto/generated)
install(FILES ${PROJECT_SOURCE_DIR}/proto/facetwise/v1/sampler.proto
  DESTINATION ${CMAKE_INSTALL_DATADIR}/facetwise/proto/facetwise/v1 COMPONENT client)
install_libraries(server TARGETS facetwise_server INCLUDES ${PROJECT_SOURCE_DIR}/service/server/include)

install(TARGETS facetwise_c LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT c NAMELINK_COMPONENT c-dev)
install(FILES ${PROJECT_SOURCE_DIR}/c/include/facetwise.h ${PROJECT_SOURCE_DIR}/c/include/facetwise_plugin.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT c-dev)
install_pkg_config(facetwise c-dev)

install(TARGETS facetwise_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
install(FILES ${PROJECT_BINARY_DIR}/app/facetwise.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT tools)
install(FILES ${PROJECT_BINARY_DIR}/app/facetwise.bash RENAME facetwise
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT tools)
set(packaging ${PROJECT_SOURCE_DIR}/service/packaging)
install(FILES ${packaging}/facetwise.service DESTINATION lib/systemd/system COMPONENT service)
install(FILES ${packaging}/grafana.json ${packaging}/haproxy.cfg DESTINATION ${CMAKE_INSTALL_DATADIR}/facetwise
  COMPONENT service)
# In a package alone, since it is at this place whatever the prefix.
install(FILES ${packaging}/serve.toml DESTINATION /etc/facetwise COMPONENT service EXCLUDE_FROM_ALL)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/python/facetwise DESTINATION lib/python3/dist-packages COMPONENT python
  PATTERN __pycache__ EXCLUDE)

# The packages. Each takes its libraries' packages from what its programs are linked with.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR facetwise)
set(CPACK_PACKAGE_CONTACT "the facetwise developers <facetwise@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_COMPONENTS_ALL engine client server c c-dev tools service python)
set(version ${PROJECT_VERSION})
function(debian_package group name description depends)
  string(TOUPPER ${group} id)
  set(CPACK_DEBIAN_${id}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_COMPONENT_${id}_DESCRIPTION "${description}" PARENT_SCOPE)
  set(CPACK_COMPONENT_GROUP_${id}_DESCRIPTION "${description}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${id}_DESCRIPTION "${description}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${id}_PACKAGE_DEPENDS "${depends}" PARENT_SCOPE)
  foreach(component IN LISTS ARGN)
    string(TOUPPER ${component} component_id)
    set(CPACK_COMPONENT_${component_id}_GROUP ${group} PARENT_SCOPE)
  endforeach()
endfunction()
debian_package(library libfacetwise0 "Microfacet normals and reflections in bulk: the C library" "" c)
debian_package(dev libfacetwise-dev "Microfacet normals and reflections in bulk: headers and static libraries"
  "libfacetwise0 (= ${version}), libabsl-dev, libhwy-dev, libtbb-dev, libgrpc++-dev, libprotobuf-dev, libssl-dev, \
libspdlog-dev, nlohmann-json3-dev, prometheus-cpp-dev" engine client server c-dev)
debian_package(command facetwise "Microfacet normals and reflections in bulk: the command" "" tools)
debian_package(daemon facetwise-server "Microfacet normals and reflections in bulk: a server as a service"
  "facetwise (= ${version})" service)
debian_package(module python3-facetwise "Microfacet normals and reflections in bulk: for Python"
  "libfacetwise0 (= ${version}), python3, python3-numpy" python)
set(CPACK_DEBIAN_DAEMON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_MODULE_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/packages/triggers)
set(CPACK_DEBIAN_DAEMON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/packages/conffiles)
set(CPACK_DEBIAN_MODULE_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/packages/prerm)
include(CPack)
